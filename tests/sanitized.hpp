#pragma once
// Whether a sanitizer is compiled in: everything is then some times slower, freed memory is kept for a while, and no
// library can be preloaded. A test that tries many cases of one kind tries fewer of them.

namespace diastole {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define DIASTOLE_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define DIASTOLE_SANITIZED 1
#endif
#endif

#ifdef DIASTOLE_SANITIZED
inline constexpr bool sanitized = true;
#else
inline constexpr bool sanitized = false;
#endif

}  // namespace diastole
