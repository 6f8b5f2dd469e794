/* The declarations of windows.h that springls.h uses where SPRINGLS_THREADS is defined. */
#ifndef MSVC_WINDOWS_H
#define MSVC_WINDOWS_H
#define INFINITE 0xffffffffu
typedef unsigned long DWORD;
typedef void *HANDLE;
typedef struct { void *Ptr; } SRWLOCK;
typedef struct { void *Ptr; } CONDITION_VARIABLE;
typedef struct { DWORD dwNumberOfProcessors; } SYSTEM_INFO;
#ifdef __cplusplus
extern "C" {
#endif
void InitializeSRWLock(SRWLOCK *lock);
void AcquireSRWLockExclusive(SRWLOCK *lock);
void ReleaseSRWLockExclusive(SRWLOCK *lock);
void InitializeConditionVariable(CONDITION_VARIABLE *condition);
void WakeConditionVariable(CONDITION_VARIABLE *condition);
void WakeAllConditionVariable(CONDITION_VARIABLE *condition);
int SleepConditionVariableSRW(CONDITION_VARIABLE *condition, SRWLOCK *lock, DWORD milliseconds, DWORD flags);
DWORD WaitForSingleObject(HANDLE handle, DWORD milliseconds);
int CloseHandle(HANDLE handle);
void GetSystemInfo(SYSTEM_INFO *info);
long InterlockedIncrement(volatile long *number);
#ifdef __cplusplus
}
#endif
#endif
