/* The declarations of assert.h that springls.h uses. */
#undef assert
#ifdef NDEBUG
#define assert(condition) ((void)0)
#else
#ifdef __cplusplus
extern "C"
#endif
void springls_test_assert_failed(const char *condition, const char *file, unsigned line);
#define assert(condition) ((void)(!!(condition) || (springls_test_assert_failed(#condition, __FILE__, (unsigned)__LINE__), 0)))
#endif
