#include "firmware/core/arithmetic/fixed_point.hpp"

#include <bit>

namespace diastole::firmware {

Q64 square_root(Q64 fraction) {
  if (fraction == 0) return 0;
  const int shift = std::countl_zero(fraction) & ~1;
  const Q64 normal = fraction << shift;
  const float seed = __builtin_sqrtf(static_cast<float>(static_cast<std::uint32_t>(normal >> 40)));
  const auto root = static_cast<std::uint32_t>(seed * 0x1p20F);
  const auto remainder = static_cast<std::int64_t>(normal - std::uint64_t{root} * root);
  const float step =
      static_cast<float>(static_cast<std::int32_t>(remainder >> 12)) / static_cast<float>(root);
  const auto correction = static_cast<std::int32_t>(step * 0x1p31F);
  const Q64 seeded = Q64{root} << 32;
  const Q64 refined = seeded + (static_cast<Q64>(std::int64_t{correction}) << 12);
  // A Newton step ends a little above the root, and above that of almost 1 there is no number.
  const bool beyond = correction > 0 && refined < seeded;
  return (beyond ? ~Q64{0} : refined) >> (shift / 2);
}

}  // namespace diastole::firmware
