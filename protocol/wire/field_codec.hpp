#pragma once
// A message says once, in its `layout`, which fields it has, in which order, with which range; writing,
// reading, measuring and the schema hash are visitors of that one declaration.
//
//   template <class Self, class Visitor>
//   static constexpr void layout(Self& self, Visitor& visit) {
//     visit.field("period_us", self.period_us, 1000U, 600'000'000U);  // inclusive bounds
//     visit.choice("waveform", self.waveform, kLastWaveform);         // enumeration 0 … last, one byte
//     visit.list("position_microsteps", self.count, self.values);     // count (one byte), then the values
//     DIASTOLE_FIELDS(token, tick);                                    // fields of any value
//   }
//
// Integers are little-endian, signed ones in two's complement; nothing is padded.

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string_view>
#include <type_traits>

namespace diastole::wire {

template <class T>
using Bound = std::type_identity_t<T>;

/// Readers and writers drop the fields' names: no image carries them.
struct Nameless {
  constexpr Nameless(const char*) {}
};

class FieldWriter {
 public:
  explicit constexpr FieldWriter(std::span<std::uint8_t> out) : out_(out) {}

  template <class T>
  constexpr void field(Nameless, const T& value, Bound<T> = {}, Bound<T> = {}) {
    put(value);
  }
  template <class Enum>
  constexpr void choice(Nameless, const Enum& value, Bound<Enum>) {
    put(static_cast<std::uint8_t>(value));
  }
  template <class T, std::size_t N>
  constexpr void list(Nameless, const std::uint8_t& count, const std::array<T, N>& values) {
    put(count);
    for (std::size_t i = 0; i < count && i < N; ++i)
      put(values[i]);
  }
  [[nodiscard]] constexpr std::size_t size() const { return size_; }

 private:
  template <class T>
  constexpr void put(T value) {
    auto rest = static_cast<std::make_unsigned_t<T>>(value);
    for (std::size_t i = 0; i < sizeof(T) && size_ < out_.size(); ++i) {
      out_[size_++] = static_cast<std::uint8_t>(rest & 0xFFU);
      rest = static_cast<std::make_unsigned_t<T>>(static_cast<std::uint64_t>(rest) >> 8);
    }
  }
  std::span<std::uint8_t> out_;
  std::size_t size_ = 0;
};

enum class DecodeProblem : std::uint8_t { none = 0, wrong_length, out_of_range };

/// What is wrong with a payload, and in which field (counted from 0 in the layout).
struct DecodeFault {
  DecodeProblem problem = DecodeProblem::none;
  std::uint8_t field = 0;
  constexpr bool operator==(const DecodeFault&) const = default;
};

class FieldReader {
 public:
  explicit constexpr FieldReader(std::span<const std::uint8_t> in) : in_(in) {}

  template <class T>
  constexpr void field(Nameless, T& value, Bound<T> least = std::numeric_limits<T>::min(),
                       Bound<T> most = std::numeric_limits<T>::max()) {
    value = take<T>();
    check(value >= least && value <= most);
  }
  template <class Enum>
  constexpr void choice(Nameless, Enum& value, Bound<Enum> last) {
    const auto number = take<std::uint8_t>();
    if (check(number <= static_cast<std::uint8_t>(last))) value = static_cast<Enum>(number);
  }
  template <class T, std::size_t N>
  constexpr void list(Nameless, std::uint8_t& count, std::array<T, N>& values) {
    count = take<std::uint8_t>();
    if (!check(count <= N)) return;
    for (std::size_t i = 0; i < N && i < count; ++i)
      values[i] = take<T>();
  }
  /// The first fault met, if any; also bytes left over are a wrong length.
  [[nodiscard]] constexpr DecodeFault fault() const {
    if (fault_.problem == DecodeProblem::none && at_ != in_.size())
      return {DecodeProblem::wrong_length, index_};
    return fault_;
  }

 private:
  template <class T>
  constexpr T take() {
    if (in_.size() - at_ < sizeof(T)) {
      at_ = in_.size();
      raise(DecodeProblem::wrong_length);
      return T{};
    }
    std::uint64_t bits = 0;
    for (std::size_t i = sizeof(T); i-- > 0;)
      bits = (bits << 8) | in_[at_ + i];
    at_ += sizeof(T);
    return static_cast<T>(bits);
  }
  constexpr bool check(bool in_range) {
    if (!in_range) raise(DecodeProblem::out_of_range);
    ++index_;
    return in_range;
  }
  constexpr void raise(DecodeProblem problem) {
    if (fault_.problem == DecodeProblem::none) fault_ = {problem, index_};
  }
  std::span<const std::uint8_t> in_;
  std::size_t at_ = 0;
  DecodeFault fault_;
  std::uint8_t index_ = 0;
};

/// FNV-1a over names, widths, bounds and order of the fields: two builds with equal hashes agree on every
/// byte.
class SchemaHasher {
 public:
  template <class T>
  constexpr void field(std::string_view name, const T&, Bound<T> least = std::numeric_limits<T>::min(),
                       Bound<T> most = std::numeric_limits<T>::max()) {
    text(name);
    number(sizeof(T) + (std::is_signed_v<T> ? 16U : 0U));
    number(static_cast<std::uint64_t>(least));
    number(static_cast<std::uint64_t>(most));
  }
  template <class Enum>
  constexpr void choice(std::string_view name, const Enum&, Bound<Enum> last) {
    text(name);
    number(static_cast<std::uint64_t>(last));
  }
  template <class T, std::size_t N>
  constexpr void list(std::string_view name, const std::uint8_t&, const std::array<T, N>&) {
    text(name);
    number(sizeof(T));
    number(N);
  }
  constexpr void text(std::string_view words) {
    for (const char letter : words)
      byte(static_cast<std::uint8_t>(letter));
    byte(0);
  }
  constexpr void number(std::uint64_t value) {
    for (int i = 0; i < 8; ++i, value >>= 8)
      byte(static_cast<std::uint8_t>(value & 0xFFU));
  }
  [[nodiscard]] constexpr std::uint32_t value() const { return hash_; }

 private:
  constexpr void byte(std::uint8_t value) { hash_ = (hash_ ^ value) * 16777619U; }
  std::uint32_t hash_ = 2166136261U;
};

// Fields of any value one after the other, each under its own name: DIASTOLE_FIELDS(token, received_tick); in a layout.
#define DIASTOLE_FIELDS(...) DIASTOLE_SCAN(DIASTOLE_EACH_FIELD(__VA_ARGS__))
#define DIASTOLE_EACH_FIELD(name, ...) \
  visit.field(#name, self.name) __VA_OPT__(; DIASTOLE_MORE_FIELDS DIASTOLE_PARENTHESES(__VA_ARGS__))
#define DIASTOLE_MORE_FIELDS() DIASTOLE_EACH_FIELD
#define DIASTOLE_PARENTHESES ()
#define DIASTOLE_SCAN(...) DIASTOLE_SCAN4(DIASTOLE_SCAN4(DIASTOLE_SCAN4(DIASTOLE_SCAN4(__VA_ARGS__))))
#define DIASTOLE_SCAN4(...) DIASTOLE_SCAN1(DIASTOLE_SCAN1(DIASTOLE_SCAN1(DIASTOLE_SCAN1(__VA_ARGS__))))
#define DIASTOLE_SCAN1(...) __VA_ARGS__

}  // namespace diastole::wire
