#include "estimator/io/record_file.hpp"

#include <gmock/gmock.h>

#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr RecordFormat curves{"diastole-curve", "a specimen's curve", "Delete it."};

std::string refusal_of(const char* text) {
  try {
    curves.read(text, "curve.json",
                [](const Json& json) { (void)json.at("points").get<std::vector<double>>(); });
  } catch (const InputError& error) {
    return error.what();
  }
  return "read";
}

// What is taken from a record by hand is refused as what is taken by its members: never as an error of the program.
TEST(RecordFile, WhateverIsWrongInItIsRefusedWithItsFile) {
  EXPECT_EQ(refusal_of(R"({"format": "diastole-curve", "format_version": 1, "points": [1, 2]})"), "read");
  EXPECT_THAT(refusal_of(R"({"format": "diastole-curve", "format_version": 1, "points": null})"),
              AllOf(HasSubstr("curve.json"), HasSubstr("of another kind")));
  EXPECT_THAT(refusal_of(R"({"format": "diastole-curve", "format_version": 1})"),
              HasSubstr("a value is missing"));
  EXPECT_THAT(refusal_of(R"({"format": "diastole-curve", "format_version": 1, "points": [1e999]})"),
              HasSubstr("a number beyond all that are kept"));
  EXPECT_THAT(refusal_of("{"), HasSubstr("this is no JSON"));
}

}  // namespace
}  // namespace diastole
