#include "protocol/signal/zero_phase.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace diastole::signal {
namespace {

constexpr double look_ahead_cycles = 20;  // of the cutoff

}  // namespace

ZeroPhaseFilter::ZeroPhaseFilter(const LowPassDesign& design, Take take)
    : design_(design),
      take_(std::move(take)),
      pad_(3 * static_cast<size_t>(design.order + 1)),
      look_ahead_(static_cast<size_t>(std::ceil(look_ahead_cycles * design.rate_Hz / design.cutoff_Hz))),
      filter_(design) {}

void ZeroPhaseFilter::push(double value) {
  if (std::isnan(value)) {
    end_stretch();
    take_(value);
    return;
  }
  if (begun_) {
    filter_on(value);
    tail_.push_back(value);
    if (tail_.size() > 2 * (pad_ + 1))
      tail_.erase(tail_.begin(), tail_.end() - static_cast<std::ptrdiff_t>(pad_ + 1));
  } else {
    head_.push_back(value);
    if (head_.size() > pad_) begin_stretch();
  }
  if (forward_.size() >= 2 * look_ahead_) {
    give_out(0, look_ahead_);
    forward_.erase(forward_.begin(), forward_.begin() + static_cast<std::ptrdiff_t>(look_ahead_));
  }
}

void ZeroPhaseFilter::begin_stretch() {
  filter_ = LowPass(design_);
  for (size_t i = std::min(pad_, head_.size() - 1); i > 0; --i)
    (void)filter_.push(2 * head_.front() - head_[i]);
  for (const double value : head_)
    filter_on(value);
  tail_ = std::exchange(head_, {});
  begun_ = true;
}

void ZeroPhaseFilter::end_stretch() {
  if (!begun_ && head_.empty()) return;
  if (!begun_) begin_stretch();
  const size_t values = forward_.size();
  const size_t pad = std::min(pad_, tail_.size() - 1);
  for (size_t i = 1; i <= pad; ++i)
    filter_on(2 * tail_.back() - tail_[tail_.size() - 1 - i]);
  give_out(0, values);
  forward_.clear();
  tail_.clear();
  begun_ = false;
}

void ZeroPhaseFilter::give_out(size_t first, size_t count) {
  std::vector<double> backward(count);
  LowPass filter(design_);
  for (size_t i = forward_.size(); i > first; --i) {
    const double value = filter.push(forward_[i - 1]);
    if (i - 1 < first + count) backward[i - 1 - first] = value;
  }
  for (const double value : backward)
    take_(value);
}

std::vector<double> filter_zero_phase(std::span<const double> values, std::span<const size_t> breaks,
                                      const LowPassDesign& design) {
  std::vector<double> filtered;
  ZeroPhaseFilter filter(design, [&](double value) { filtered.push_back(value); });
  auto next_break = breaks.begin();
  for (size_t row = 0; row < values.size(); ++row) {
    if (next_break != breaks.end() && *next_break == row) {
      filter.end_stretch();
      ++next_break;
    }
    filter.push(values[row]);
  }
  filter.end_stretch();
  return filtered;
}

}  // namespace diastole::signal
