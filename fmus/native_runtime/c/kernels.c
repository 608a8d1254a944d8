#include "kernels.h"

#include <math.h>

/* A few numbers as one, for sums, whose order a compiler may not change by itself. GCC and Clang
   both know this; where the processor has shorter vectors they take several. Others get plain C,
   and so does who defines RAILCOSIM_PLAIN_C. */
#if defined(__GNUC__) && !defined(RAILCOSIM_PLAIN_C)
#define HAS_VECTORS
#endif
#ifdef HAS_VECTORS
#define VECTOR(Number, n) __attribute__((vector_size(n * sizeof(Number)), aligned(sizeof(Number)), \
                                         may_alias))
typedef double Four VECTOR(double, 4);
typedef float FourFloats VECTOR(float, 4);
#define LANES 4
#define Lanes Four
#define LANE(lanes, l) ((lanes)[l])
#define WIDE(floats, place) __builtin_convertvector(*(const FourFloats *)((floats) + (place)), Four)
#else
#define LANES 1
#define Lanes double
#define LANE(lanes, l) (lanes)
#define WIDE(floats, place) ((double)(floats)[place])
#endif
#define AT(array, place) (*(const Lanes *)((array) + (place)))
#define PUT(array, place) (*(Lanes *)((array) + (place)))
#define ONE(array, place) ((array)[place])
/* Kernels that were included as each##_.. and as sums##_... */
#define KERNELS(each, sums)                                                                       \
    {evaluate_both_##each, drive_##each, drive_both_##each, observe_##sums, look_##sums,          \
     respond_##sums, add_##each, advance_##each, advance_both_##each, add_line_##each,            \
     add_product_##sums, take_product_##sums, factor_##sums, substitute_##sums,                      \
     finite_##sums}

#define NAME(kernel) kernel##_plain
#define TARGET
#include "kernels_each.h"
#include "kernels_sums.h"
#undef NAME
#undef TARGET
static const Kernels kernels_plain = KERNELS(plain, plain);

#if (defined(__x86_64__) || defined(_M_X64)) && defined(HAS_VECTORS)
#define HAS_AVX
#include <immintrin.h>
#undef WIDE /* GCC makes a dozen instructions of the other one */
#define WIDE(floats, place) (Four)_mm256_cvtps_pd(_mm_loadu_ps((floats) + (place)))
#define NAME(kernel) kernel##_avx2
#define TARGET __attribute__((target("avx2")))
#include "kernels_each.h"
#include "kernels_sums.h"
#undef NAME
#undef TARGET
static const Kernels kernels_avx2 = KERNELS(avx2, avx2);

/* Twice as wide where no sum is taken, so the bits are the same. */
#undef LANES
#undef Lanes
#undef WIDE
typedef double Eight VECTOR(double, 8);
#define LANES 8
#define Lanes Eight
#define WIDE(floats, place) (Eight)_mm512_cvtps_pd(_mm256_loadu_ps((floats) + (place)))
#define NAME(kernel) kernel##_avx512
#define TARGET __attribute__((target("avx512f")))
#include "kernels_each.h"
static const Kernels kernels_avx512 = KERNELS(avx512, avx2);
#include <cpuid.h>

/* The processor has an instruction set, a bit of the answer to question 7; and the operating system
   keeps the registers it uses. */
static int works(unsigned instructions, unsigned registers)
{
    unsigned a, b, c, d, low, high;
    if (!__get_cpuid(1, &a, &b, &c, &d) || !(c & bit_OSXSAVE))
        return 0;
    __asm__("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    if ((low & registers) != registers)
        return 0;
    return __get_cpuid_count(7, 0, &a, &b, &c, &d) && (b & instructions);
}

enum { WIDE_REGISTERS = 6, WIDEST_REGISTERS = 0xe6 };
#endif

const Kernels *kernels_for_this_processor(void)
{
#ifdef HAS_AVX
    const int avx2 = works(bit_AVX2, WIDE_REGISTERS);
    if (avx2 && works(bit_AVX512F, WIDEST_REGISTERS))
        return &kernels_avx512;
    if (avx2)
        return &kernels_avx2;
#endif
    return &kernels_plain;
}
