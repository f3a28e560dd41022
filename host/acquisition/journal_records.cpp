#include "host/acquisition/journal_records.hpp"

#include <bit>
#include <cstring>

namespace diastole {
namespace {

static_assert(std::endian::native == std::endian::little, "journals are little-endian");

template <typename Value>
void put(std::vector<uint8_t>& out, const Value& value) {
  const auto* bytes = reinterpret_cast<const uint8_t*>(&value);
  out.insert(out.end(), bytes, bytes + sizeof(Value));
}

template <typename Value>
void put_all(std::vector<uint8_t>& out, const std::vector<Value>& values) {
  const auto* bytes = reinterpret_cast<const uint8_t*>(values.data());
  out.insert(out.end(), bytes, bytes + values.size() * sizeof(Value));
}

template <typename Value>
Value take(std::span<const uint8_t>& in) {
  Value value;
  std::memcpy(&value, in.data(), sizeof(Value));
  in = in.subspan(sizeof(Value));
  return value;
}

template <typename Value>
std::vector<Value> take_all(std::span<const uint8_t>& in, size_t count) {
  std::vector<Value> values(count);
  if (count > 0) std::memcpy(values.data(), in.data(), count * sizeof(Value));
  in = in.subspan(count * sizeof(Value));
  return values;
}

constexpr size_t sample_header_bytes = 16;
constexpr size_t position_header_bytes = 20;

}  // namespace

std::vector<uint8_t> encode(const SampleBlock& block) {
  std::vector<uint8_t> out;
  put(out, block.first_index);
  put(out, static_cast<uint32_t>(block.host_ns.size()));
  put(out, block.channels);
  put_all(out, block.host_ns);
  put_all(out, block.value_kPa);
  return out;
}

std::vector<uint8_t> encode(const PositionBlock& block) {
  std::vector<uint8_t> out;
  put(out, block.first_index);
  put(out, static_cast<uint32_t>(block.microsteps.size()));
  put(out, block.first_tick);
  put(out, block.period_ticks);
  put_all(out, block.microsteps);
  return out;
}

std::optional<SampleBlock> decode_samples(std::span<const uint8_t> payload) {
  if (payload.size() < sample_header_bytes) return std::nullopt;
  SampleBlock block;
  block.first_index = take<uint64_t>(payload);
  const size_t samples = take<uint32_t>(payload);
  block.channels = take<uint32_t>(payload);
  if (payload.size() / sizeof(uint64_t) < samples ||
      payload.size() != samples * (1 + size_t{block.channels}) * sizeof(double)) {
    return std::nullopt;
  }
  block.host_ns = take_all<uint64_t>(payload, samples);
  block.value_kPa = take_all<double>(payload, samples * block.channels);
  return block;
}

std::optional<PositionBlock> decode_positions(std::span<const uint8_t> payload) {
  if (payload.size() < position_header_bytes) return std::nullopt;
  PositionBlock block;
  block.first_index = take<uint32_t>(payload);
  const size_t count = take<uint32_t>(payload);
  block.first_tick = take<uint64_t>(payload);
  block.period_ticks = take<uint32_t>(payload);
  if (payload.size() != count * sizeof(int32_t)) return std::nullopt;
  block.microsteps = take_all<int32_t>(payload, count);
  return block;
}

}  // namespace diastole
