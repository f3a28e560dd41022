#include "firmware/core/jog.hpp"

#include <algorithm>

namespace diastole::firmware {

namespace {

std::uint64_t size_of(std::int64_t distance_nL) {
  return static_cast<std::uint64_t>(distance_nL < 0 ? -distance_nL : distance_nL);
}

std::uint64_t allowed_flow_uL_per_s(const Settings& settings, bool position_known) {
  const wire::Configure& limits = settings.limits();
  const std::uint64_t flow = (settings.hand_steps_per_s() * limits.microstep_pL + 999'999) / 1'000'000;
  return position_known ? flow : std::min<std::uint64_t>(flow, limits.homing_flow_uL_per_s);
}

PlanRefusal excess(wire::Limit limit, std::int64_t asked, std::int64_t allowed) {
  return {wire::Refusal::limit_exceeded, limit, 0, asked, allowed};
}

}  // namespace

PlanRefusal check_jog(const wire::Jog& jog, const Settings& settings, bool position_known, Steps position) {
  const wire::Configure& limits = settings.limits();
  const auto travel_nL = static_cast<std::int64_t>(limits.travel_uL) * 1000;
  const auto here_nL = position.count * static_cast<std::int64_t>(limits.microstep_pL) / 1000;
  const auto size_nL = static_cast<std::int64_t>(size_of(jog.distance_nL));
  const std::int64_t reach_nL = position_known ? here_nL + jog.distance_nL : size_nL;
  if (reach_nL > travel_nL) return excess(wire::Limit::travel, reach_nL / 1000, limits.travel_uL);
  const std::int32_t steps = settings.steps_of_nL(size_of(jog.distance_nL)).count;
  if (steps == 0) return excess(wire::Limit::stroke_at_least, size_nL, (limits.microstep_pL + 999) / 1000);
  if (position_known && jog.distance_nL < 0 && steps > position.count)
    return excess(wire::Limit::home, size_nL / 1000, here_nL / 1000);
  const std::uint64_t allowed = allowed_flow_uL_per_s(settings, position_known);
  if (jog.flow_uL_per_s > allowed)
    return excess(wire::Limit::flow, jog.flow_uL_per_s, static_cast<std::int64_t>(allowed));
  return {};
}

RestToRestMove jog_move(const wire::Jog& jog, const Settings& settings) {
  const std::uint64_t speed = std::max<std::uint64_t>(settings.steps_per_s(jog.flow_uL_per_s), 1);
  return {static_cast<std::uint32_t>(settings.steps_of_nL(size_of(jog.distance_nL)).count), speed,
          std::max<std::uint64_t>(settings.stop_steps_per_s2() / 4, 1)};
}

}  // namespace diastole::firmware
