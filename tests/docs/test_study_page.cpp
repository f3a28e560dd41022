// docs/study-file.md has the keys that the study's reader knows, section by section, and no others.
//
// A key is known where the reader complains of its value, and unknown where it says so. What could be a key is every word in
// quotes in the reader's source and every key of the page; each is tried in each section.

#include <gmock/gmock.h>

#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "estimator/io/study.hpp"
#include "estimator/materials/law.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole {
namespace {

namespace fs = std::filesystem;
using Keys = std::set<std::string>;

const fs::path root = DIASTOLE_SOURCE_DIR;
const std::string head = "Head";

std::string text_of(const fs::path& path) {
  std::stringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

/// What `pattern` matches in its first group.
std::vector<std::string> all_of(const std::string& text, const std::regex& pattern) {
  std::vector<std::string> found;
  for (std::sregex_iterator match(text.begin(), text.end(), pattern), end; match != end; ++match)
    found.push_back((*match)[1]);
  return found;
}

class Page {
 public:
  Page() {
    static const std::regex heading(R"(^## `?([^`]+)`?$)"), code(R"re(`"?([^`"]+)"?`)re");
    std::stringstream lines(text_of(root / "docs/study-file.md"));
    std::string section, table;
    bool in_example = false;
    for (std::string line; std::getline(lines, line);) {
      std::smatch match;
      if (line.starts_with("```")) {
        in_example = line == "```toml";
        if (in_example) examples.emplace_back();
      } else if (in_example) {
        examples.back() += line + "\n";
      } else if (std::regex_match(line, match, heading)) {
        section = match[1];
      } else if (!line.starts_with("|")) {
        table.clear();
      } else {
        const std::string first = line.substr(0, line.find('|', 1));
        const bool is_head = table.empty();
        if (is_head) table = first;
        if (is_head || first.starts_with("|-")) continue;
        const std::vector<std::string> words = all_of(first, code);
        if (table == "| key ") keys[section].insert(words.begin(), words.end());
        if (table != "| law ") continue;
        const size_t second = line.find('|', 1);
        laws[words.at(0)] = all_of(line.substr(second, line.find('|', second + 1) - second), code);
      }
    }
  }

  std::map<std::string, Keys> keys;  ///< by section, "[specimen]"
  std::map<std::string, std::vector<std::string>> laws;
  std::vector<std::string> examples;  ///< the first one whole, the others parts of a study
};

constexpr const char* top = "format = \"diastole-study\"\nversion = 1\n";
constexpr const char* annulus =
    "[specimen]\nkind = \"annulus\"\ninner_radius_mm = 20.0\nouter_radius_mm = 50.0\nheight_mm = 80.0\n"
    "mesh = [8, 4, 1]\nends = \"fixed\"\n";
constexpr const char* rest =
    "[law]\nname = \"neo-hookean\"\n[law.parameters.C1_kPa]\nstart = 6.0\nbounds = [1.0, 15.0]\n"
    "[data]\n[images]\n"
    "[images.to_specimen]\norigin_mm = [0, 0, 0]\nx_axis = [1, 0, 0]\ny_axis = [0, 1, 0]\nz_axis = [0, 0, "
    "1]\n"
    "[chamber]\n[model]\neffects = [\"x\"]\n[model.parameters.x.y]\nstart = 1.0\n"
    "[[model.moments.x]]\nrun = \"a\"\ntime_s = 1.0\n[model.error]\n";

/// Sound studies of every kind.
std::vector<std::string> studies() {
  std::vector<std::string> bodies{annulus};
  bodies.push_back(
      "[specimen]\nkind = \"annulus\"\ninner_radius_mm = 20.0\nouter_radius_mm = 50.0\nheight_mm = 80.0\n"
      "mesh = [8, 4, 1]\nends = \"sprung\"\nbond_normal_kPa_per_mm = 1.0\nbond_tangential_kPa_per_mm = "
      "1.0\n");
  bodies.push_back(
      "[specimen]\nkind = \"ellipsoid\"\ninner_axes_mm = [20.0, 50.0]\nouter_axes_mm = [30.0, 60.0]\n"
      "base_z_mm = 15.0\nfibre_endo_deg = 60.0\nfibre_epi_deg = -60.0\nmesh = [8, 4, 1]\nends = \"fixed\"\n");
  bodies.push_back("[specimen]\nkind = \"mesh\"\nends = \"fixed\"\nfile = \"a\"\n");
  bodies.push_back("[specimen]\nkind = \"fitted-lv\"\nends = \"fixed\"\nmesh_file = \"a\"\n");
  for (std::string& body : bodies)
    body = top + body + rest;
  return bodies;
}

/// The line in a study that opens what the page calls "[law.parameters.NAME]".
std::string opening(const std::string& section) {
  static const std::map<std::string, std::string> with_names{
      {"[law.parameters.NAME]", "[law.parameters.C1_kPa]"},
      {"[model.parameters.ID.NAME]", "[model.parameters.x.y]"},
      {"[[model.moments.ID]]", "[[model.moments.x]]"}};
  const auto named = with_names.find(section);
  return (named == with_names.end() ? section : named->second) + "\n";
}

class StudyPage : public testing::Test {
 protected:
  /// Whether the reader of any kind of study asks for this key in this section.
  bool is_known(const std::string& section, const std::string& key) const {
    for (std::string study : studies()) {
      size_t at = study.find("[specimen]");
      if (section != head) {
        const size_t line = study.find("\n" + opening(section));
        if (line == std::string::npos) continue;
        at = line + 1 + opening(section).size();
      }
      study.insert(at, key + " = 2026-01-01\n");  // a date, which no key holds
      const std::string message =
          test::message_of([&] { (void)read_study(folder_.write("a.study.toml", study)); });
      if (message.find("is not a key that is known here") == std::string::npos) return true;
      if (section != "[specimen]") break;  // only its keys depend on the kind
    }
    return false;
  }

  const Page page_;
  const test::ScratchFolder folder_;
};

TEST_F(StudyPage, HasTheKeysOfTheReaderSectionBySection) {
  for (const std::string& study : studies())
    EXPECT_EQ(test::message_of([&] { (void)read_study(folder_.write("a.study.toml", study)); }),
              "(no error)");
  static const std::regex word(R"re("([A-Za-z][A-Za-z0-9_]*)")re");
  const std::vector<std::string> words = all_of(text_of(root / "estimator/io/study.cpp"), word);
  Keys candidates(words.begin(), words.end());
  for (const auto& [section, keys] : page_.keys)
    candidates.insert(keys.begin(), keys.end());
  ASSERT_FALSE(is_known("[specimen]", "no_such_key"));

  std::set<std::string> sections{head};
  for (const std::string& line : all_of(top + std::string(annulus) + rest, std::regex(R"(\n(\[.*\])(?=\n))")))
    sections.insert(line);
  EXPECT_EQ(page_.keys.size(), sections.size()) << "the page and this test differ in their sections";
  for (const auto& [section, keys] : page_.keys) {
    Keys known;
    for (const std::string& key : candidates)
      if (is_known(section, key)) known.insert(key);
    EXPECT_EQ(keys, known) << section;
  }
}

// A new law is a file and a line in a list, and needs no row here.
TEST_F(StudyPage, ItsLawsHaveTheseParameters) {
  ASSERT_FALSE(page_.laws.empty());
  for (const auto& [name, parameters] : page_.laws) {
    const Law* law = find_law(name);
    ASSERT_NE(law, nullptr) << name;
    std::vector<std::string> names;
    for (const LawParameter& parameter : law->parameters())
      names.emplace_back(parameter.name);
    EXPECT_EQ(parameters, names) << name;
  }
}

TEST_F(StudyPage, TheReaderTakesItsExamples) {
  ASSERT_GT(page_.examples.size(), 1U);
  const std::string& whole = page_.examples.front();
  for (const std::string& example : page_.examples) {
    const std::string study = &example == &whole ? whole : whole + example;
    EXPECT_EQ(test::message_of([&] { (void)read_study(folder_.write("a.study.toml", study)); }), "(no error)")
        << example;
  }
}

}  // namespace
}  // namespace diastole
