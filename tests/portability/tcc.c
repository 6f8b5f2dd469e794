/* tcc.c - why springls.h refuses tcc: prints -5 where a compiler is right. tcc 0.9.27 for x86-64 prints -4: it stores the two
   registers in which a struct of three floats is returned, 16 bytes, in a temporary of 12, over the variable beside it. */
#include <stdio.h>

typedef struct { float x, y, z; } vector;

static vector difference(vector a, vector b)
{
    vector d;
    d.x = a.x - b.x;
    d.y = a.y - b.y;
    d.z = a.z - b.z;
    return d;
}

static float last(vector a, vector b, float x)
{
    (void)a;
    (void)b;
    return x;
}

static float negated(vector a, vector b, float x)
{
    float overwritten = x;
    return last(difference(a, b), b, -overwritten);
}

int main(void)
{
    vector a = { 1, 2, 3 }, b = { 4, 5, 6 };
    printf("%g\n", negated(a, b, 5));
    return 0;
}
