// MCC USB-1208LS in scan mode.
//
//   [daq]
//   driver = "usb-1208ls"
//   serial = "01AB23CD"             # optional: which one of several
//   [[daq.channel]]
//   input = 0                       # differential input 0 ... 3
//   range_V = 10                    # 20, 10, 5, 4, 2.5, 2, 1.25 or 1, either way
//
// Up to four channels; three are sampled as four, the last one twice.

#include "host/daq/usb1208ls.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/daq/driver.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::daq {
namespace {

class Usb1208ls final : public BlockInstrument {
 public:
  Usb1208ls(Usb1208lsSetup setup, OpenHid open)
      : setup_(std::move(setup)), open_(std::move(open)), queue_(setup_.queue), port_(open_(setup_.address)) {
    if (queue_.size() == 3) queue_.push_back(queue_.back());
  }

  [[nodiscard]] std::string describe() const override {
    return "usb-1208ls" + (setup_.address.serial.empty() ? std::string() : " " + setup_.address.serial);
  }
  [[nodiscard]] size_t channels() const override { return setup_.queue.size(); }
  [[nodiscard]] size_t block_samples() const override { return usb1208ls::block_conversions / queue_.size(); }

  [[nodiscard]] RatePlan plan_rate(double asked_Hz) const override {
    const auto conversions = static_cast<double>(queue_.size());
    if (asked_Hz * conversions < usb1208ls::least_conversions_Hz ||
        asked_Hz * conversions > usb1208ls::most_conversions_Hz) {
      throw InputError({"", "sample_rate_Hz",
                        fmt::format("{:g} Hz is not what a USB-1208LS can do with {} channels", asked_Hz,
                                    setup_.queue.size()),
                        fmt::format("Ask for {:g} to {:g} Hz.", usb1208ls::least_conversions_Hz / conversions,
                                    usb1208ls::most_conversions_Hz / conversions)});
    }
    return {usb1208ls::pace_for(asked_Hz * conversions).rate_Hz() / conversions, {}};
  }

  Outcome start(double rate_Hz) override {
    try {
      if (port_ == nullptr) port_ = open_(setup_.address);
    } catch (const HardwareError& error) {
      return {false, error.what()};
    }
    counter_ = {};
    const auto pace = usb1208ls::pace_for(rate_Hz * static_cast<double>(queue_.size()));
    if (port_->write_output(usb1208ls::stop_scan()) && port_->write_output(usb1208ls::load_queue(queue_)) &&
        port_->write_output(usb1208ls::start_scan(pace))) {
      return {};
    }
    return lost();
  }

  Outcome read(Batch& out) override {
    if (port_ == nullptr) return {false, "the device is not open"};
    const auto block = usb1208ls::decode_block(port_->read_feature(usb1208ls::block_report_bytes));
    if (!block) return lost();
    if (block->error != 0) return {false, fmt::format("the device reports error {}", block->error)};
    const auto number = counter_.take(block->number);
    if (!number) return {};  // one that came before
    out.first_index = *number * block_samples();
    out.volts.clear();
    for (size_t i = 0; i < block->counts.size(); ++i) {
      const size_t entry = i % queue_.size();
      if (entry < channels()) out.volts.push_back(usb1208ls::volts(block->counts[i], queue_[entry].range));
    }
    return {};
  }

  void stop() override {
    if (port_ != nullptr) (void)port_->write_output(usb1208ls::stop_scan());
  }

 private:
  Outcome lost() {
    const std::string problem = port_->problem();
    port_.reset();
    return {false, "the device does not answer" + (problem.empty() ? "" : ": " + problem)};
  }

  Usb1208lsSetup setup_;
  OpenHid open_;
  std::vector<usb1208ls::QueueEntry> queue_;  // as loaded: 1, 2 or 4
  std::unique_ptr<HidPort> port_;             // null: to be opened anew
  usb1208ls::BlockCounter counter_;
};

usb1208ls::QueueEntry read_entry(TableReader& channel) {
  usb1208ls::QueueEntry entry;
  entry.channel = static_cast<uint8_t>(channel.integer("input", {.at_least = 0, .at_most = 3}));
  const double range_V = channel.number_or("range_V", 10);
  const auto* range = std::find_if(usb1208ls::ranges.begin(), usb1208ls::ranges.end(),
                                   [&](const usb1208ls::Range& each) { return each.volts == range_V; });
  if (range == usb1208ls::ranges.end()) {
    channel.fail("range_V", fmt::format("{:g} is no range of a USB-1208LS", range_V),
                 "Use 20, 10, 5, 4, 2.5, 2, 1.25 or 1.");
  }
  entry.range = *range;
  return entry;
}

}  // namespace

std::unique_ptr<BlockInstrument> open_usb1208ls(Usb1208lsSetup setup, OpenHid open) {
  return std::make_unique<Usb1208ls>(std::move(setup), std::move(open));
}

Usb1208lsSetup read_usb1208ls(TableReader& daq, std::vector<TableReader>& channels) {
  Usb1208lsSetup setup;
  setup.address.serial = daq.text_or("serial", "");
  for (TableReader& channel : channels)
    setup.queue.push_back(read_entry(channel));
  if (setup.queue.size() > 4) {
    daq.fail("channel", fmt::format("is given {} times", setup.queue.size()),
             "A USB-1208LS has four differential inputs.");
  }
  return setup;
}

namespace {

OpenInstrument configure(TableReader& daq, std::vector<TableReader>& channels) {
  const Usb1208lsSetup setup = read_usb1208ls(daq, channels);
  return [setup](const OpenOptions& options) -> std::unique_ptr<Instrument> {
    Usb1208lsSetup opened = setup;
    if (options.address) opened.address.serial = *options.address;
    return open_usb1208ls(opened, options.open_hid ? options.open_hid : open_hidapi);
  };
}

}  // namespace

const Driver usb1208ls_driver{"usb-1208ls", Line::hid, configure};

}  // namespace diastole::daq
