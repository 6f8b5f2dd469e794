/* test_more_lives.c - the random lives of test_lives.c, more of them. */
#define MORE_LIVES
enum { FIRST_LIFE = 1001, LIVES = 201 };
#include "test_lives.c"
