#pragma once
// A value or a numbered reason, without exceptions and without heap: what every fallible call of the wire
// library and of the firmware returns. T and E must be default-constructible; reading the side that is not
// there yields its default value, never undefined behaviour.

namespace diastole::wire {

template <class T, class E>
class [[nodiscard]] Result {
 public:
  constexpr Result(T value) : value_(value), ok_(true) {}
  constexpr Result(E error) : error_(error), ok_(false) {}

  [[nodiscard]] constexpr bool ok() const { return ok_; }
  constexpr explicit operator bool() const { return ok_; }
  [[nodiscard]] constexpr const T& value() const { return value_; }
  [[nodiscard]] constexpr const E& error() const { return error_; }
  constexpr const T* operator->() const { return &value_; }
  constexpr const T& operator*() const { return value_; }

 private:
  T value_{};
  E error_{};
  bool ok_;
};

}  // namespace diastole::wire
