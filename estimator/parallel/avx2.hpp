#pragma once
// A function compiled twice, the second time with vectors of four doubles for processors that have them (AVX2). Products and sums stay what
// they are and in their order (no fused ones), so that results are the same to the bit on either. By GCC only: sanitizers (Clang) cannot
// follow the choice, which is made before they are ready.

#ifdef __clang__
#define DIASTOLE_ALSO_FOR_AVX2
#else
#define DIASTOLE_ALSO_FOR_AVX2 [[gnu::target_clones("avx2", "default")]]
#endif
