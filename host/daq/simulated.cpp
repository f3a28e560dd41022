// No instrument at all: a sine of 1 V and 1 Hz on every channel, for trying out a daemon and for loading it.
//
//   [daq]
//   driver = "simulated"
//   [[daq.channel]]
//   input = 3                       # 0 ... 63: that many sixteenths of a turn ahead
//
// It samples by the host's clock and keeps what is not taken for buffer_ns; what is older then is lost, as with a real
// instrument.

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/daq/driver.hpp"
#include "host/transport/clock.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::daq {
namespace {

constexpr double ns_per_s = 1e9;
constexpr double block_s = 0.02;
constexpr uint64_t buffer_ns = 200'000'000;
constexpr double sine_Hz = 1;
constexpr int64_t inputs_in_a_turn = 16;

class Simulated final : public BlockInstrument {
 public:
  Simulated(std::vector<int64_t> inputs, std::function<uint64_t()> now_ns)
      : inputs_(std::move(inputs)), now_ns_(std::move(now_ns)) {}

  [[nodiscard]] std::string describe() const override { return "simulated"; }
  [[nodiscard]] size_t channels() const override { return inputs_.size(); }
  [[nodiscard]] RatePlan plan_rate(double asked_Hz) const override {
    return {asked_Hz, "the instrument is simulated: what is recorded as pressure was not measured"};
  }
  [[nodiscard]] size_t block_samples() const override {
    return static_cast<size_t>(std::max(1.0, std::round(rate_Hz_ * block_s)));
  }

  Outcome start(double rate_Hz) override {
    rate_Hz_ = rate_Hz;
    next_ = 0;
    start_ns_ = now_ns_();
    return {};
  }

  /// Never waits: gives what is due.
  Outcome read(Batch& out) override {
    const uint64_t due = samples_in(now_ns_() - start_ns_) + 1;
    const uint64_t kept = samples_in(buffer_ns) + 1;
    if (due > next_ + kept) next_ = due - kept;
    out.first_index = next_;
    out.volts.clear();
    for (; next_ < due; ++next_)
      append_row(out.volts);
    return {};
  }

  void stop() override {}

 private:
  [[nodiscard]] uint64_t samples_in(uint64_t time_ns) const {
    return static_cast<uint64_t>(static_cast<double>(time_ns) * rate_Hz_ / ns_per_s);
  }

  void append_row(std::vector<double>& volts) const {
    const double angle = 2 * std::numbers::pi * std::fmod(sine_Hz * static_cast<double>(next_) / rate_Hz_, 1);
    for (const int64_t input : inputs_)
      volts.push_back(std::sin(angle + 2 * std::numbers::pi * static_cast<double>(input) / inputs_in_a_turn));
  }

  std::vector<int64_t> inputs_;
  std::function<uint64_t()> now_ns_;
  double rate_Hz_ = 1;
  uint64_t start_ns_ = 0;
  uint64_t next_ = 0;
};

OpenInstrument configure(TableReader& /*daq*/, std::vector<TableReader>& channels) {
  std::vector<int64_t> inputs;
  for (TableReader& channel : channels)
    inputs.push_back(channel.integer("input", {.at_least = 0, .at_most = 63}));
  return [inputs](const OpenOptions& options) -> std::unique_ptr<Instrument> {
    if (options.address) {
      throw InputError({"", "--daq " + *options.address, "means nothing to the driver \"simulated\"",
                        "Leave it out, or name the instrument's driver in [daq] of the rig file."});
    }
    return std::make_unique<Simulated>(
        inputs, options.now_ns ? options.now_ns : [] { return RealClock().now_ns(); });
  };
}

}  // namespace

const Driver simulated_driver{"simulated", Line::none, configure};

}  // namespace diastole::daq
