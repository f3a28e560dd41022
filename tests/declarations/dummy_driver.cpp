// An instrument that shows as many volts as the number of its input.

#include <algorithm>

#include "host/daq/driver.hpp"

namespace diastole::daq {
namespace {

class Dummy final : public PolledInstrument {
 public:
  explicit Dummy(std::vector<double> volts) : volts_(std::move(volts)) {}

  [[nodiscard]] std::string describe() const override { return "dummy"; }
  [[nodiscard]] size_t channels() const override { return volts_.size(); }
  Outcome read(std::span<double> volts) override {
    std::ranges::copy(volts_, volts.begin());
    return {};
  }

 private:
  std::vector<double> volts_;
};

OpenInstrument configure(TableReader& /*daq*/, std::vector<TableReader>& channels) {
  std::vector<double> volts;
  for (TableReader& channel : channels)
    volts.push_back(static_cast<double>(channel.integer("input", {.at_least = 0, .at_most = 9})));
  return [volts](const OpenOptions&) { return std::make_unique<Dummy>(volts); };
}

}  // namespace

const Driver dummy_driver{"dummy", Line::none, configure};

}  // namespace diastole::daq
