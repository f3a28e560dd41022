#include "tests/host/bench/desk.hpp"

#include <algorithm>

namespace diastole {

void Desk::advance_to(uint64_t until_ns) {
  if (until_ns <= now_ns) return;
  now_ns = until_ns;
  const uint64_t ticks_per_us = static_cast<uint64_t>(firmware::kTicksPerMicrosecond);
  const uint64_t tick = (now_ns - controller_started_ns) * ticks_per_us / 1000;
  controller->advance_to({static_cast<decltype(firmware::Ticks::count)>(tick)});
  const auto sent = controller->take_output();
  controller->take_edges();
  to_host.insert(to_host.end(), sent.begin(), sent.end());
}

void DeskLine::write(std::span<const uint8_t> bytes) {
  if (desk_.plugged) desk_.controller->feed(bytes);
}

size_t DeskLine::read(std::span<uint8_t> out) {
  if (!desk_.plugged) return 0;
  const size_t count = std::min(out.size(), desk_.to_host.size());
  const auto end = desk_.to_host.begin() + static_cast<std::ptrdiff_t>(count);
  std::copy(desk_.to_host.begin(), end, out.begin());
  desk_.to_host.erase(desk_.to_host.begin(), end);
  return count;
}

daq::Outcome DeskInstrument::read(std::span<double> volts) {
  const uint64_t reading = readings++;
  desk_.advance_to(desk_.now_ns + delay_ns(reading));
  volts[0] = volts_at(1e-9 * static_cast<double>(desk_.now_ns));
  return fault(reading);
}

std::optional<uint32_t> DeskInstrument::read_timer() {
  const double ticks = static_cast<double>(desk_.now_ns) * 0.04 * (1 + 1e-6 * clock_error_ppm);
  return static_cast<uint32_t>(static_cast<uint64_t>(ticks));
}

RigConfig example_rig() { return read_rig(std::filesystem::path(DIASTOLE_SOURCE_DIR) / "examples/rig.toml"); }

}  // namespace diastole
