// Keeps the documents true: what they link to exists, and a linked symbol still stands in the linked file.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
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

// The tree at the head of ARCHITECTURE.md names each room; tests/ mirrors the others.
TEST(Documents, TheTreeInTheArchitectureNamesEveryFolder) {
  const std::string text = text_of(root / "ARCHITECTURE.md");
  const size_t begin = text.find("```\n"), end = text.find("```\n", begin + 1);
  ASSERT_NE(end, std::string::npos);
  const std::string tree = text.substr(begin, end - begin);
  const auto names = [&](const std::string& folder) {
    return std::regex_search(tree, std::regex("\\b" + folder + "\\b"));
  };
  std::vector<fs::path> rooms{root};
  for (const char* room : {"protocol", "firmware", "firmware/core", "host", "estimator", "estimator/explain",
                           "estimator/imaging", "tools", "tools/sim_board"}) {
    rooms.push_back(root / room);
  }
  for (const fs::path& room : rooms) {
    for (const auto& entry : fs::directory_iterator(room)) {
      const std::string name = entry.path().filename();
      if (!entry.is_directory() || name.starts_with('.') || name == "build") continue;
      EXPECT_TRUE(names(name)) << fs::relative(entry.path(), root) << " is not in ARCHITECTURE.md's tree";
    }
  }
}

// The walks of ARCHITECTURE.md lead past each header of the rooms whose names alone say little.
TEST(Documents, TheWalksInTheArchitectureNameEveryHeaderOfFitAndExplain) {
  const std::string text = text_of(root / "ARCHITECTURE.md");
  for (const char* room :
       {"estimator/fit", "estimator/explain/rig", "estimator/explain/imaging", "estimator/explain/verdict"}) {
    for (const auto& entry : fs::directory_iterator(root / room)) {
      if (entry.path().extension() != ".hpp") continue;
      const std::string header = fs::relative(entry.path(), root).generic_string();
      EXPECT_NE(text.find("(" + header + ")"), std::string::npos)
          << "ARCHITECTURE.md does not name " << header;
    }
  }
}

// A comment may send the reader to another header only if there is one: beside the file, or anywhere by the end of its path.
TEST(Documents, EveryHeaderThatACommentNamesExists) {
  static const std::regex header(R"(//[^\n]*?([\w./-]+\.hpp))");
  std::string headers;
  std::vector<fs::path> sources;
  for (const char* room : {"protocol", "firmware", "host", "estimator", "tools", "tests"}) {
    for (const auto& entry : fs::recursive_directory_iterator(root / room)) {
      const fs::path extension = entry.path().extension();
      if (extension == ".hpp") headers += "/" + fs::relative(entry.path(), root).generic_string() + "\n";
      if (extension == ".hpp" || extension == ".cpp" || extension == ".inc") sources.push_back(entry.path());
    }
  }
  int named = 0;
  for (const fs::path& source : sources) {
    const std::string text = text_of(source);
    for (std::sregex_iterator match(text.begin(), text.end(), header), end; match != end; ++match) {
      const std::string name = (*match)[1];
      EXPECT_NE(headers.find("/" + name + "\n"), std::string::npos)
          << fs::relative(source, root) << " names " << name << ", which does not exist";
      ++named;
    }
  }
  EXPECT_GT(named, 0);
}

// Recordings are cited by name only where a clone has them; what another one is, words say.
TEST(Documents, EveryRecordingThatIsNamedIsInTheTree) {
  static const std::regex name(R"(\b(case-\d{3}|field-\d{3}|r\d-\d{2})\b)");
  std::set<std::string> recordings;
  for (const auto& entry : fs::recursive_directory_iterator(root / "tests/data")) {
    const std::string file = entry.path().filename();
    recordings.insert(file.substr(0, file.find('.')));
  }
  std::vector<fs::path> texts = documents();
  for (const char* room : {"protocol", "firmware", "host", "estimator", "tools", "examples", "python"}) {
    for (const auto& entry : fs::recursive_directory_iterator(root / room)) {
      static const std::set<std::string> kinds{".hpp", ".cpp", ".inc", ".md", ".toml", ".py"};
      if (kinds.contains(entry.path().extension())) texts.push_back(entry.path());
    }
  }
  int named = 0;
  for (const fs::path& document : texts) {
    const std::string text = text_of(document);
    for (std::sregex_iterator match(text.begin(), text.end(), name), end; match != end; ++match) {
      EXPECT_TRUE(recordings.contains((*match)[1])) << fs::relative(document, root) << " names the recording "
                                                    << (*match)[1] << ", which is not in tests/data";
      ++named;
    }
  }
  EXPECT_GT(named, 0);
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
