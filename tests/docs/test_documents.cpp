// Keeps the documents true: what they link to exists, and a linked symbol still stands in the linked file.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

const fs::path root = DIASTOLE_SOURCE_DIR;

std::string text_of(const fs::path& path) {
  std::ifstream stream(path);
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

std::vector<fs::path> documents() {
  std::vector<fs::path> found;
  for (const auto& entry : fs::directory_iterator(root)) {
    if (entry.path().extension() == ".md") found.push_back(entry.path());
  }
  for (const auto& entry : fs::recursive_directory_iterator(root / "docs")) {
    if (entry.path().extension() == ".md") found.push_back(entry.path());
  }
  return found;
}

struct Link {
  std::string text;
  std::string target;
};

std::vector<Link> links_of(const std::string& text) {
  static const std::regex link(R"(\[([^\]]*)\]\(([^)#\s]+)(#[^)]*)?\))");
  std::vector<Link> found;
  for (std::sregex_iterator match(text.begin(), text.end(), link), end; match != end; ++match) {
    found.push_back({(*match)[1], (*match)[2]});
  }
  return found;
}

bool is_external(const std::string& target) { return target.find("://") != std::string::npos; }

TEST(Documents, EveryLinkLeadsSomewhere) {
  ASSERT_FALSE(documents().empty());
  for (const fs::path& document : documents()) {
    for (const Link& link : links_of(text_of(document))) {
      if (is_external(link.target)) continue;
      EXPECT_TRUE(fs::exists(document.parent_path() / link.target))
          << fs::relative(document, root) << " links to " << link.target << ", which does not exist";
    }
  }
}

// A link whose text is code, [`Planner::plan`](firmware/core/planner.hpp), claims that the file holds the name.
TEST(Documents, ALinkedSymbolStandsInTheLinkedFile) {
  static const std::regex code(R"(^`([A-Za-z_:]+)(\(\))?`$)");
  int symbols = 0;
  for (const fs::path& document : documents()) {
    for (const Link& link : links_of(text_of(document))) {
      std::smatch match;
      if (is_external(link.target) || !std::regex_match(link.text, match, code)) continue;
      const fs::path file = document.parent_path() / link.target;
      if (!fs::is_regular_file(file)) continue;
      const std::string name = match[1].str().substr(match[1].str().rfind(':') + 1);
      EXPECT_NE(text_of(file).find(name), std::string::npos)
          << fs::relative(document, root) << ": " << link.target << " no longer holds " << match[1];
      ++symbols;
    }
  }
  EXPECT_GT(symbols, 0);
}

TEST(Documents, EveryBareSourcePathExists) {
  static const std::regex path(
      R"(`((protocol|firmware|host|estimator|tools|tests|docs|examples|cmake)/[\w./-]+)`)");
  for (const fs::path& document : documents()) {
    const std::string text = text_of(document);
    for (std::sregex_iterator match(text.begin(), text.end(), path), end; match != end; ++match) {
      EXPECT_TRUE(fs::exists(root / (*match)[1].str()))
          << fs::relative(document, root) << " names " << (*match)[1] << ", which does not exist";
    }
  }
}

TEST(Documents, EveryDecisionHasItsOwnNumber) {
  static const std::regex name(R"((\d{4})-[a-z0-9-]+\.md)");
  std::map<std::string, std::string> by_number;
  for (const auto& entry : fs::directory_iterator(root / "docs/decisions")) {
    const std::string file = entry.path().filename();
    std::smatch match;
    ASSERT_TRUE(std::regex_match(file, match, name)) << file << " is not called NNNN-title.md";
    const auto [other, first] = by_number.emplace(match[1], file);
    EXPECT_TRUE(first) << file << " and " << other->second << " have the same number";
    std::smatch heading;
    const std::string text = text_of(entry.path());
    static const std::regex numbered(R"(^# (\d{4}))");
    if (std::regex_search(text, heading, numbered)) {
      EXPECT_EQ(heading[1], match[1]) << file;
    }
  }
  EXPECT_FALSE(by_number.empty());
}

}  // namespace
