#pragma once
// The last number of a list (*_list.inc), for messages that take no number beyond it.

#include <initializer_list>

namespace diastole::wire {

template <class Number>
consteval Number last_of(std::initializer_list<Number> listed) {
  Number last{};
  for (const Number number : listed)
    if (number > last) last = number;
  return last;
}

}  // namespace diastole::wire
