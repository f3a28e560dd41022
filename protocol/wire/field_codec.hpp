#pragma once
// A message says once which fields it has, at which offset, with which range; its members, and writing, reading and the
// schema hash, which are visitors of its `layout`, follow from that table.
//
//   struct Example {
//     DIASTOLE_LAYOUT(Example,                                                  // kType is MessageType::Example
//                     (value, 0, std::uint32_t, token),                         // any value
//                     (within, 4, std::uint32_t, period_us, 1000U, 60'000U),    // inclusive bounds
//                     (choice, 8, Waveform, waveform, kLastWaveform),           // enumeration 0 … last, one byte
//                     (list, 9, count, std::int32_t, position_microsteps, 50))  // count (one byte), so many values
//   };
//
// A member begins at 0, or at its least value where 0 is none. What a table cannot say has a `layout` of its own.
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

template <class T>
constexpr T least_unless_0(T least, T most) {
  return least <= T{} && most >= T{} ? T{} : least;
}

#define DIASTOLE_LAYOUT(message, ...)                                  \
  DIASTOLE_SCAN(DIASTOLE_EACH_ROW(DIASTOLE_MEMBER, __VA_ARGS__))       \
  static constexpr void layout(auto& self, auto& visit) {              \
    DIASTOLE_SCAN(DIASTOLE_EACH_ROW(DIASTOLE_VISIT, __VA_ARGS__))      \
  }                                                                    \
  static constexpr std::size_t kOffsets[] = {                          \
      DIASTOLE_SCAN(DIASTOLE_EACH_ROW(DIASTOLE_OFFSET, __VA_ARGS__))}; \
  static constexpr MessageType kType = MessageType::message;
#define DIASTOLE_MEMBER(kind, offset, ...) DIASTOLE_MEMBER_##kind(__VA_ARGS__)
#define DIASTOLE_MEMBER_value(type, name) type name{};
#define DIASTOLE_MEMBER_within(type, name, least, most) type name = least_unless_0<type>(least, most);
#define DIASTOLE_MEMBER_choice(type, name, last) type name{};
#define DIASTOLE_MEMBER_list(count, type, name, most) \
  std::uint8_t count = 0;                             \
  std::array<type, most> name{};
#define DIASTOLE_VISIT(kind, offset, ...) DIASTOLE_VISIT_##kind(__VA_ARGS__)
#define DIASTOLE_VISIT_value(type, name) visit.field(#name, self.name);
#define DIASTOLE_VISIT_within(type, name, least, most) visit.field(#name, self.name, least, most);
#define DIASTOLE_VISIT_choice(type, name, last) visit.choice(#name, self.name, last);
#define DIASTOLE_VISIT_list(count, type, name, most) visit.list(#name, self.count, self.name);
#define DIASTOLE_OFFSET(kind, offset, ...) offset,

// Applies `what` to each row.
#define DIASTOLE_EACH_ROW(what, row, ...) \
  what row __VA_OPT__(DIASTOLE_MORE_ROWS DIASTOLE_PARENTHESES(what, __VA_ARGS__))
#define DIASTOLE_MORE_ROWS() DIASTOLE_EACH_ROW
#define DIASTOLE_PARENTHESES ()
#define DIASTOLE_SCAN(...) DIASTOLE_SCAN4(DIASTOLE_SCAN4(DIASTOLE_SCAN4(DIASTOLE_SCAN4(__VA_ARGS__))))
#define DIASTOLE_SCAN4(...) DIASTOLE_SCAN1(DIASTOLE_SCAN1(DIASTOLE_SCAN1(DIASTOLE_SCAN1(__VA_ARGS__))))
#define DIASTOLE_SCAN1(...) __VA_ARGS__

}  // namespace diastole::wire
