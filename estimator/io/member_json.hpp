#pragma once
// Records as JSON by one list of their members, which serves writing and reading:
//
//   DIASTOLE_MEMBERS(Slice, rows, offset_mm)                // beside Slice, in its namespace
//
//   json = written(slice);        read_json(json, slice);
//
// A member is a number, a text, an enumeration with JsonWords, a record, or a list, std::array or std::optional of such.
// JSON has no NaN and no infinity: they are written as null, and null is read as NaN, an empty text or an empty optional.
// A list in which members need one of the forms below (may_lack, if_any, by_name) is written out:
//
//   template <class Visit, IsRecord<Slice> Record>
//   void each_member(Visit&& visit, Record& slice) {
//     DIASTOLE_VISIT(visit, slice, rows, offset_mm)
//     visit("tags", by_name(slice.tags));
//   }
//
// A type with a form of its own specialises JsonForm.

#include <fmt/format.h>

#include <array>
#include <boost/preprocessor/seq/for_each.hpp>
#include <boost/preprocessor/stringize.hpp>
#include <boost/preprocessor/tuple/elem.hpp>
#include <boost/preprocessor/variadic/to_seq.hpp>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <ranges>
#include <stdexcept>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

namespace diastole {

using Json = nlohmann::ordered_json;

/// A record of this type, to be read or to be written.
template <class T, class Record>
concept IsRecord = std::is_same_v<std::remove_const_t<T>, Record>;

#define DIASTOLE_VISIT_ONE(r, visit_and_record, member) \
  BOOST_PP_TUPLE_ELEM(0, visit_and_record)              \
  (BOOST_PP_STRINGIZE(member), BOOST_PP_TUPLE_ELEM(1, visit_and_record).member);
/// Visits members under their own names, in this order.
#define DIASTOLE_VISIT(visit, record, ...) \
  BOOST_PP_SEQ_FOR_EACH(DIASTOLE_VISIT_ONE, (visit, record), BOOST_PP_VARIADIC_TO_SEQ(__VA_ARGS__))
/// A record whose members are all visited so.
#define DIASTOLE_MEMBERS(Type, ...)                         \
  template <class Visit, ::diastole::IsRecord<Type> Record> \
  void each_member(Visit&& visit, Record& record) {         \
    DIASTOLE_VISIT(visit, record, __VA_ARGS__)              \
  }

template <class T>
concept HasMembers = requires(T& value) {
  each_member([](const char*, auto&&) {}, value);
};

/// A member that a file may lack, which then keeps its value.
template <class T>
struct MayLack {
  T& value;
  bool written_if_empty;
};
template <class T>
MayLack<T> may_lack(T& value) {
  return {value, true};
}
/// A list or optional that a file lacks if it is empty.
template <class T>
MayLack<T> if_any(T& value) {
  return {value, false};
}

template <class T>
bool is_empty(const T& value) {
  if constexpr (requires { value.empty(); }) {
    return value.empty();
  } else {
    return !value.has_value();
  }
}

/// A list as an object: its entries' first or `name` are the keys, their second or they themselves the values.
template <class List>
struct ByName {
  List& entries;
};
template <class List>
ByName<List> by_name(List& entries) {
  return {entries};
}
template <class Entry>
auto key_and_value(Entry& entry) {
  if constexpr (requires { entry.first; }) {
    return std::tie(entry.first, entry.second);
  } else {
    return std::tie(entry.name, entry);
  }
}

/// Specialise with `static Json written(const T&)` and `static void read(const Json&, T&)`.
template <class T>
struct JsonForm;
template <class T>
concept HasJsonForm = requires {
  sizeof(JsonForm<T>);
};

/// Specialise for an enumeration: `kind`, what its values are called, `all` of them, and `word_of(value)`.
template <class T>
struct JsonWords;

template <class T>
Json written(const T& value) {
  if constexpr (HasJsonForm<T>) {
    return JsonForm<T>::written(value);
  } else if constexpr (HasMembers<const T>) {
    Json json = Json::object();
    const auto write_member = [&](const char* name, const auto& member) {
      if constexpr (requires { member.written_if_empty; }) {
        if (member.written_if_empty || !is_empty(member.value)) json[name] = written(member.value);
      } else {
        json[name] = written(member);
      }
    };
    each_member(write_member, value);
    return json;
  } else if constexpr (requires { value.entries; }) {
    Json json = Json::object();
    for (const auto& entry : value.entries) {
      const auto [name, of_name] = key_and_value(entry);
      json[name] = written(of_name);
    }
    return json;
  } else if constexpr (std::is_enum_v<T>) {
    return JsonWords<T>::word_of(value);
  } else if constexpr (std::is_floating_point_v<T>) {
    return std::isfinite(value) ? Json(value) : Json(nullptr);
  } else if constexpr (std::is_integral_v<T> || std::is_same_v<T, std::string>) {
    return value;
  } else if constexpr (std::ranges::range<T>) {
    Json json = Json::array();
    for (const auto& member : value)
      json.push_back(written(member));
    return json;
  } else {
    return value ? written(*value) : Json(nullptr);
  }
}

/// Every number in it that has a fraction, as `round` makes it.
inline void round_numbers(Json& json, double (*round)(double)) {
  for (Json& member : json) {
    if (member.is_structured()) round_numbers(member, round);
    if (member.is_number_float()) member = round(member.get<double>());
  }
}

/// Whether a record may lack members, which then keep the values that they have.
enum class MissingMembers { refused, kept };

/// A record, or a member of one, that is not as it must be: what() is what is wrong with it.
class MemberFault : public std::invalid_argument {
 public:
  explicit MemberFault(const std::string& problem, std::string member = {})
      : std::invalid_argument(problem), member_(std::move(member)) {}
  /// "frames[2].sigma_kPa"; empty: the record itself.
  [[nodiscard]] const std::string& member() const { return member_; }

 private:
  std::string member_;
};

/// The same fault, `name` before the member's own: "sigma_kPa", "[2]".
inline MemberFault within(std::string_view name, const MemberFault& fault) {
  const bool is_named = !fault.member().empty() && fault.member().front() != '[';
  return MemberFault(fault.what(), fmt::format("{}{}{}", name, is_named ? "." : "", fault.member()));
}

/// Throws MemberFault with the value for one of another kind.
inline void require_kind(bool is_so, const Json& json, const char* kind) {
  constexpr size_t most_shown = 40;
  if (is_so) return;
  const std::string value = json.dump(-1, ' ', true);  // in ASCII, which may be cut anywhere
  throw MemberFault(fmt::format("{}{} is no {}", value.substr(0, most_shown),
                                value.size() > most_shown ? "..." : "", kind));
}

/// Throws MemberFault for what is missing or of another kind.
template <class T>
void read_json(const Json& json, T& value, MissingMembers missing = MissingMembers::refused);

template <HasMembers T>
void read_members(const Json& json, T& record, MissingMembers missing) {
  require_kind(json.is_object(), json, "object");
  const auto read_member = [&](const char* name, auto&& member) {
    constexpr bool optional = requires { member.written_if_empty; };
    const auto found = json.find(name);
    if (found == json.end()) {
      if (optional || missing == MissingMembers::kept) return;
      throw MemberFault("is missing", name);
    }
    try {
      if constexpr (optional) {
        read_json(*found, member.value, missing);
      } else {
        read_json(*found, member, missing);
      }
    } catch (const MemberFault& fault) {
      throw within(name, fault);
    }
  };
  each_member(read_member, record);
}

template <class List>
void read_entries(const Json& json, List& entries, MissingMembers missing) {
  require_kind(json.is_object(), json, "object");
  entries.clear();
  for (const auto& [key, of_key] : json.items()) {
    auto [name, value] = key_and_value(entries.emplace_back());
    name = key;
    try {
      read_json(of_key, value, missing);
    } catch (const MemberFault& fault) {
      throw within(key, fault);
    }
  }
}

template <class T>
void read_word(const Json& json, T& value) {
  const auto word = json.is_string() ? json.get<std::string>() : std::string();
  for (const T known : JsonWords<T>::all) {
    if (JsonWords<T>::word_of(known) == word) return void(value = known);
  }
  require_kind(false, json, JsonWords<T>::kind);
}

template <class Whole>
void read_whole(const Json& json, Whole& value) {
  require_kind(json.is_number_integer() && std::in_range<Whole>(json.get<int64_t>()), json,
               "whole number in range");
  value = static_cast<Whole>(json.get<int64_t>());
}

/// Member by member, each with its place in the list.
void read_each(const Json& json, auto& list, MissingMembers missing) {
  for (size_t i = 0; i < json.size(); ++i) {
    try {
      read_json(json[i], list[i], missing);
    } catch (const MemberFault& fault) {
      throw within(fmt::format("[{}]", i), fault);
    }
  }
}

template <class T, size_t Count>
void read_list(const Json& json, std::array<T, Count>& list, MissingMembers missing) {
  if (!json.is_array() || json.size() != Count) throw MemberFault(fmt::format("is no list of {}", Count));
  read_each(json, list, missing);
}

template <class T>
void read_list(const Json& json, std::vector<T>& list, MissingMembers missing) {
  require_kind(json.is_array(), json, "list");
  list.clear();
  list.resize(json.size());
  read_each(json, list, missing);
}

template <class T>
void read_json(const Json& json, T& value, MissingMembers missing) {
  if constexpr (HasJsonForm<T>) {
    JsonForm<T>::read(json, value);
  } else if constexpr (HasMembers<T>) {
    read_members(json, value, missing);
  } else if constexpr (requires { value.entries; }) {
    read_entries(json, value.entries, missing);
  } else if constexpr (std::is_enum_v<T>) {
    read_word(json, value);
  } else if constexpr (std::is_floating_point_v<T>) {
    require_kind(json.is_number() || json.is_null(), json, "number");
    value = json.is_null() ? std::numeric_limits<T>::quiet_NaN() : json.get<T>();
  } else if constexpr (std::is_same_v<T, bool>) {
    require_kind(json.is_boolean(), json, "boolean");
    value = json.get<bool>();
  } else if constexpr (std::is_integral_v<T>) {
    read_whole(json, value);
  } else if constexpr (std::is_same_v<T, std::string>) {
    require_kind(json.is_string() || json.is_null(), json, "text");
    value = json.is_null() ? "" : json.get<std::string>();
  } else if constexpr (std::ranges::range<T>) {
    read_list(json, value, missing);
  } else if (json.is_null()) {
    value.reset();
  } else {
    read_json(json, value.emplace(), missing);
  }
}

}  // namespace diastole
