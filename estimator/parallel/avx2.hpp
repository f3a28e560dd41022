#pragma once
// A function compiled twice, the second time with vectors of four doubles for processors that have them (AVX2). Products and sums stay what
// they are and in their order (no fused ones), so that results are the same to the bit on either. Not with sanitizers: the choice is made
// before they are ready.

#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define DIASTOLE_ALSO_FOR_AVX2
#endif
#endif
#ifndef DIASTOLE_ALSO_FOR_AVX2
#define DIASTOLE_ALSO_FOR_AVX2 [[gnu::target_clones("avx2", "default")]]
#endif
