#include <gmock/gmock.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "estimator/io/whole_file.hpp"
#include "tests/estimator/cli/run_command.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole {
namespace {

using testing::HasSubstr;

constexpr const char* example = DIASTOLE_SOURCE_DIR "/examples/shear-test.csv";

using test::Outcome;

Outcome run(const std::vector<std::string>& arguments) { return test::run_command(arguments); }

TEST(ShearCommand, JsonHoldsWhatTheContractSays) {
  const Outcome outcome = run({"shear", example, "--json"});
  EXPECT_EQ(outcome.code, ExitCode::done);
  const auto json = nlohmann::json::parse(outcome.output);
  EXPECT_NEAR(json.at("C1_kPa").get<double>(), 8.71, 0.1);
  EXPECT_LE(json.at("se_kPa").get<double>(), 0.06);
  EXPECT_GT(json.at("r2").get<double>(), 0.997);
  EXPECT_EQ(json.at("loads").size(), 4U);
}

TEST(ShearCommand, TheRotationFormIsSharper) {
  const auto se_kPa = [](const std::vector<std::string>& arguments) {
    return nlohmann::json::parse(run(arguments).output).at("se_kPa").get<double>();
  };
  EXPECT_LT(se_kPa({"shear", example, "--json", "--form", "rotation"}),
            0.8 * se_kPa({"shear", example, "--json"}));
}

TEST(ShearCommand, WritesItsPage) {
  const test::ScratchFolder folder;
  const auto page = folder.path() / "shear.html";
  const Outcome outcome = run({"shear", example, "-o", page.string()});
  EXPECT_THAT(outcome.output, testing::AllOf(HasSubstr("C1 = 8.7"), HasSubstr("shear.html")));
  EXPECT_GT(std::filesystem::file_size(page), 5000U);
  EXPECT_THROW((void)run({"shear", example, "-o", (folder.path() / "no/such/page.html").string()}),
               InputError);
}

TEST(ShearCommand, DoesNotReplaceItsDataOrAnythingElse) {
  const test::ScratchFolder folder;
  const std::string data = (folder.path() / "data.csv").string();
  std::filesystem::copy_file(example, data);
  const std::string before = read_whole_file(data);
  EXPECT_THAT(test::message_of([&] {
                (void)run({"shear", data, "--force", "-o", data});
              }),
              HasSubstr("is read by this command"));
  EXPECT_EQ(read_whole_file(data), before);
  const std::string notes = folder.write("notes.html", "mine").string();
  EXPECT_THAT(test::message_of([&] { (void)run({"shear", data, "-o", notes}); }), HasSubstr("--force"));
  EXPECT_EQ(run({"shear", data, "--force", "-o", notes}).code, ExitCode::done);
  EXPECT_EQ(run({"shear", data, "-o", notes}).code, ExitCode::done);
}

TEST(ShearCommand, WhatTheDataDoNotDetermineIsANegativeAnswer) {
  const test::ScratchFolder folder;
  const auto data =
      folder.write("backwards.csv",
                   "inner_radius_mm,outer_radius_mm,height_mm,moment_Nmm,radius_mm,rotation_deg\n"
                   "8,19,24,10,10,-1\n8,19,24,10,12,-1.6\n8,19,24,10,15,-1.9\n");
  const test::ScratchFolder pages;
  const Outcome outcome =
      run({"shear", data.string(), "--json", "-o", (pages.path() / "page.html").string()});
  EXPECT_EQ(outcome.code, ExitCode::negative);
  const auto json = nlohmann::json::parse(outcome.output);
  EXPECT_FALSE(json.at("determined").get<bool>());
  EXPECT_TRUE(json.at("ci95_kPa").at(1).is_null());
}

}  // namespace
}  // namespace diastole
