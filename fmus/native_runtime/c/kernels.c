#include "kernels.h"

#include <math.h>

/* A few numbers as one, for sums, whose order a compiler may not change by itself. GCC and Clang
   both know this; where the processor has shorter vectors they take several. Others get plain C,
   and so does who defines RAILCOSIM_PLAIN_C. */
#if defined(__GNUC__) && !defined(RAILCOSIM_PLAIN_C)
#define HAS_VECTORS
#endif
#ifdef HAS_VECTORS
enum { LANES = 4 };
typedef double Lanes __attribute__((vector_size(8 * LANES), aligned(8), may_alias));
#define LANE(lanes, l) ((lanes)[l])
typedef float Floats __attribute__((vector_size(4 * LANES), aligned(4), may_alias));
#define WIDE(floats, place) __builtin_convertvector(*(const Floats *)((floats) + (place)), Lanes)
#else
enum { LANES = 1 };
typedef double Lanes;
#define LANE(lanes, l) (lanes)
#define WIDE(floats, place) ((double)(floats)[place])
#endif
#define AT(array, place) (*(const Lanes *)((array) + (place)))
#define PUT(array, place) (*(Lanes *)((array) + (place)))
#define ONE(array, place) ((array)[place])

#define NAME(kernel) kernel##_plain
#define TARGET
#include "kernels_body.h"

#if (defined(__x86_64__) || defined(_M_X64)) && defined(HAS_VECTORS)
#define HAS_AVX2
#include <immintrin.h>
#undef WIDE /* GCC makes a dozen instructions of the other one */
#define WIDE(floats, place) (Lanes)_mm256_cvtps_pd(_mm_loadu_ps((floats) + (place)))
#define NAME(kernel) kernel##_avx2
#define TARGET __attribute__((target("avx2")))
#include "kernels_body.h"
#include <cpuid.h>

/* The processor has AVX2, and the operating system keeps the wide registers. */
static int avx2_works(void)
{
    unsigned a, b, c, d, low, high;
    if (!__get_cpuid(1, &a, &b, &c, &d) || !(c & bit_OSXSAVE))
        return 0;
    __asm__("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    if ((low & 6) != 6)
        return 0;
    return __get_cpuid_count(7, 0, &a, &b, &c, &d) && (b & bit_AVX2);
}
#endif

const Kernels *kernels_for_this_processor(void)
{
#ifdef HAS_AVX2
    if (avx2_works())
        return &kernels_avx2;
#endif
    return &kernels_plain;
}
