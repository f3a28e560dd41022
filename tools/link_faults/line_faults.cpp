#include "tools/link_faults/line_faults.hpp"

#include <algorithm>

namespace diastole::link_faults {

bool LineFaults::happens(double probability) {
  return probability > 0 && std::bernoulli_distribution(probability)(random_);
}

void LineFaults::push(std::span<const std::uint8_t> bytes, std::uint64_t now_us) {
  for (const std::uint8_t byte : bytes) {
    if (begun_.empty()) begun_us_ = now_us;
    begun_.push_back(byte);
    if (byte == 0) end_frame(now_us);
  }
}

void LineFaults::end_frame(std::uint64_t now_us) {
  Bytes frame;
  frame.swap(begun_);
  ++counts_.frames;
  if (happens(rates_.frame_loss)) {
    ++counts_.lost;
    return;
  }
  if (happens(rates_.reordering)) {
    ++counts_.reordered;
    const auto overtaking = 1 + static_cast<unsigned>(random_() % kMostOvertaking);
    held_.push_back({overtaking, now_us + kPatience_us, std::move(frame)});
    return;
  }
  const bool twice = happens(rates_.repetition);
  if (twice) {
    ++counts_.repeated;
    pass_on(frame, now_us);
  }
  pass_on(std::move(frame), now_us);
  release_held(now_us, true);
}

void LineFaults::release_held(std::uint64_t now_us, bool passed_by) {
  for (auto held = held_.begin(); held != held_.end();) {
    if (passed_by && held->overtaking > 0) --held->overtaking;
    if (held->overtaking > 0 && now_us < held->deadline_us) {
      ++held;
      continue;
    }
    pass_on(std::move(held->bytes), now_us);
    held = held_.erase(held);
  }
}

void LineFaults::pass_on(Bytes frame, std::uint64_t now_us) {
  std::uint64_t due_us = now_us + rates_.delay_us;
  if (rates_.jitter_us > 0) due_us += random_() % (rates_.jitter_us + 1);
  last_due_us_ = std::max(last_due_us_, due_us);
  flying_.push_back({last_due_us_, damaged(std::move(frame))});
}

LineFaults::Bytes LineFaults::damaged(Bytes frame) {
  const FaultCounts before = counts_;
  if (happens(rates_.truncation)) {
    ++counts_.truncated;
    frame.resize(random_() % frame.size());
  }
  if (rates_.byte_loss > 0) {
    const auto size = frame.size();
    std::erase_if(frame, [this](std::uint8_t) { return happens(rates_.byte_loss); });
    counts_.bytes_lost += size - frame.size();
  }
  if (rates_.bit_error > 0) {
    std::geometric_distribution<std::size_t> gap(rates_.bit_error);
    for (std::size_t bit = gap(random_); bit < frame.size() * 8; bit += 1 + gap(random_)) {
      frame[bit / 8] = static_cast<std::uint8_t>(frame[bit / 8] ^ (1U << (bit % 8)));
      ++counts_.bits_flipped;
    }
  }
  if (counts_.truncated != before.truncated || counts_.bytes_lost != before.bytes_lost ||
      counts_.bits_flipped != before.bits_flipped)
    ++counts_.damaged;
  return frame;
}

std::vector<std::uint8_t> LineFaults::take(std::uint64_t now_us) {
  if (!begun_.empty() && now_us >= begun_us_ + kPatience_us) {
    pass_on(std::move(begun_), now_us);
    begun_.clear();
  }
  release_held(now_us, false);
  Bytes through;
  while (!flying_.empty() && flying_.front().due_us <= now_us) {
    const Bytes& bytes = flying_.front().bytes;
    through.insert(through.end(), bytes.begin(), bytes.end());
    flying_.pop_front();
  }
  return through;
}

std::optional<std::uint64_t> LineFaults::next_due_us() const {
  std::optional<std::uint64_t> next;
  const auto consider = [&next](std::uint64_t due_us) { next = std::min(next.value_or(due_us), due_us); };
  if (!flying_.empty()) consider(flying_.front().due_us);
  for (const Held& held : held_)
    consider(held.deadline_us);
  if (!begun_.empty()) consider(begun_us_ + kPatience_us);
  return next;
}

}  // namespace diastole::link_faults
