#pragma once
// Records as JSON by one list of their members, which serves writing and reading:
//
//   template <class Visit, IsRecord<Slice> Record>          // beside Slice, in its namespace
//   void each_member(Visit&& visit, Record& slice) {
//     visit("rows", slice.rows);
//     visit("offset_mm", slice.offset_mm);
//   }
//
//   json = written(slice);        read_json(json, slice);
//
// A member is a number, a text, a record, or a list, std::array or std::optional of such. JSON has no NaN and no infinity:
// they are written as null, and null is read as NaN, an empty text or an empty optional. A type with a form of its own
// specialises JsonForm.

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <ranges>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace diastole {

/// A record of this type, to be read or to be written.
template <class T, class Record>
concept IsRecord = std::is_same_v<std::remove_const_t<T>, Record>;

template <class T>
concept HasMembers = requires(T& value) {
  each_member([](const char*, auto&) {}, value);
};

/// Specialise with `static Json written(const T&)` and `static void read(const Json&, T&)`.
template <class T>
struct JsonForm;

template <class T>
concept HasJsonForm = requires {
  sizeof(JsonForm<T>);
};

template <class T>
nlohmann::ordered_json written(const T& value) {
  using Json = nlohmann::ordered_json;
  if constexpr (HasJsonForm<T>) {
    return JsonForm<T>::written(value);
  } else if constexpr (HasMembers<const T>) {
    Json json = Json::object();
    each_member([&](const char* name, const auto& member) { json[name] = written(member); }, value);
    return json;
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

/// Whether a record may lack members, which then keep the values that they have.
enum class MissingMembers { refused, kept };

/// Throws nlohmann::json::exception or std::invalid_argument, which names the key, for what is missing or of another kind.
template <class T>
void read_json(const nlohmann::ordered_json& json, T& value,
               MissingMembers missing = MissingMembers::refused);

template <HasMembers T>
void read_members(const nlohmann::ordered_json& json, T& record, MissingMembers missing) {
  if (!json.is_object()) throw std::invalid_argument("is no object");
  const auto read_member = [&](const char* name, auto& member) {
    if (!json.contains(name) && missing == MissingMembers::kept) return;
    try {
      read_json(json.at(name), member, missing);
    } catch (const nlohmann::json::exception& error) {
      throw std::invalid_argument(fmt::format("key {}: {}", name, error.what()));
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(fmt::format("key {}: {}", name, error.what()));
    }
  };
  each_member(read_member, record);
}

template <class Whole>
void read_whole(const nlohmann::ordered_json& json, Whole& value) {
  if (!json.is_number_integer() || !std::in_range<Whole>(json.get<int64_t>()))
    throw std::invalid_argument(json.dump() + " is no whole number in range");
  value = static_cast<Whole>(json.get<int64_t>());
}

template <class T, size_t Count>
void read_list(const nlohmann::ordered_json& json, std::array<T, Count>& list, MissingMembers missing) {
  if (!json.is_array() || json.size() != Count)
    throw std::invalid_argument(fmt::format("is no list of {}", Count));
  for (size_t i = 0; i < Count; ++i)
    read_json(json[i], list[i], missing);
}

template <class T>
void read_list(const nlohmann::ordered_json& json, std::vector<T>& list, MissingMembers missing) {
  if (!json.is_array()) throw std::invalid_argument("is no list");
  list.clear();
  for (const auto& member : json)
    read_json(member, list.emplace_back(), missing);
}

template <class T>
void read_json(const nlohmann::ordered_json& json, T& value, MissingMembers missing) {
  if constexpr (HasJsonForm<T>) {
    JsonForm<T>::read(json, value);
  } else if constexpr (HasMembers<T>) {
    read_members(json, value, missing);
  } else if constexpr (std::is_floating_point_v<T>) {
    value = json.is_null() ? std::numeric_limits<T>::quiet_NaN() : json.get<T>();
  } else if constexpr (std::is_same_v<T, bool>) {
    value = json.get<bool>();
  } else if constexpr (std::is_integral_v<T>) {
    read_whole(json, value);
  } else if constexpr (std::is_same_v<T, std::string>) {
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
