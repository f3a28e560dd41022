#include "host/web/access_policy.hpp"

#include <gmock/gmock.h>

#include "host/web/request.hpp"
#include "protocol/contract/input_error.hpp"
#include "tests/host/bench/scratch.hpp"

namespace diastole::web {
namespace {

using testing::AllOf;
using testing::HasSubstr;

ConsoleAddress at(const std::string& text) {
  return parse_console_address(text, "rig.toml", "daemon.console");
}

bool comes_in(const AccessPolicy& policy, std::string_view host,
              std::optional<std::string_view> origin = {}) {
  return !policy.check_place(host, origin);
}

std::string token_of(const std::string& url) { return url.substr(url.find("token=") + 6); }

TEST(ConsoleAccess, AnAddressIsAPortOrAnAddressAndAPort) {
  EXPECT_EQ(at("").address.to_string(), "127.0.0.1");
  EXPECT_EQ(at("").port, usual_port);
  EXPECT_EQ(at("80").port, 80);
  EXPECT_EQ(at("[::1]:9000").address.to_string(), "::1");
  EXPECT_EQ(at("10.0.0.1:0").address.to_string(), "10.0.0.1");
  for (const char* wrong :
       {"x", "70000", "-1", "80 ", "localhost:80", "10.0.0.1:", "10.0.0.1", "::1", "[::1]", ":"}) {
    EXPECT_THAT(message_of<InputError>([&] { (void)at(wrong); }),
                AllOf(HasSubstr(wrong), HasSubstr("daemon.console"), HasSubstr("8600")));
  }
}

TEST(ConsoleAccess, ANameThatPointsHereIsNotOurs) {
  const AccessPolicy policy(at("8600"), "rigpc");
  for (const char* own : {"127.0.0.1:8600", "localhost:8600", "LOCALHOST", "[::1]:8600", "127.0.0.1:9000"})
    EXPECT_TRUE(comes_in(policy, own)) << own;
  for (const char* strange : {"", ":8600", "evil.example:8600", "127.0.0.1.evil.example", "10.0.0.1:8600",
                              "rigpc:8600", "[::1", "localhost.evil.example:8600", "127.0.0.1@evil.example"})
    EXPECT_FALSE(comes_in(policy, strange)) << strange;
}

TEST(ConsoleAccess, BeyondThisMachineItsAddressesAndItsOwnNameAreOurs) {
  const AccessPolicy policy(at("0.0.0.0:8600"), "RigPC");
  EXPECT_TRUE(policy.reaches_beyond_this_machine());
  for (const char* own : {"10.0.0.1:8600", "rigpc:8600", "RIGPC", "localhost:8600"})
    EXPECT_TRUE(comes_in(policy, own)) << own;
  for (const char* strange :
       {"evil.example:8600", "rigpcevil.example:8600", "rigpc.evil.example:8600", "rigpc.", "rig"})
    EXPECT_FALSE(comes_in(policy, strange)) << strange;
  const AccessPolicy qualified(at("0.0.0.0:8600"), "rigpc.lab.example");
  EXPECT_TRUE(comes_in(qualified, "rigpc.lab.example:8600"));
  EXPECT_TRUE(comes_in(qualified, "rigpc:8600"));
  for (const char* strange : {"rigpc.lab:8600", "rigpc.evil.example:8600", "lab.example:8600"})
    EXPECT_FALSE(comes_in(qualified, strange)) << strange;
  EXPECT_THAT(policy.url(ConsoleRole::control, 8600), testing::StartsWith("https://rigpc:8600/#token="));
}

TEST(ConsoleAccess, APageOfAnotherSiteIsRefused) {
  const AccessPolicy policy(at("8600"), "rigpc");
  const std::string_view host = "127.0.0.1:8600";
  EXPECT_TRUE(comes_in(policy, host, "http://127.0.0.1:8600"));
  for (const char* strange : {"", "null", "http://evil.example", "http://127.0.0.1:8601", "http://127.0.0.1",
                              "http://127.0.0.1:8600.evil.example", "file://"})
    EXPECT_FALSE(comes_in(policy, host, strange)) << strange;
}

TEST(ConsoleAccess, EachTokenOpensForItsRoleAndNothingElseOpens) {
  const AccessPolicy policy(at("8600"), "rigpc");
  const std::string control = token_of(policy.url(ConsoleRole::control, 8600));
  const std::string watch = token_of(policy.url(ConsoleRole::watch, 8600));
  EXPECT_EQ(policy.role_of(control), ConsoleRole::control);
  EXPECT_EQ(policy.role_of(watch), ConsoleRole::watch);
  EXPECT_FALSE(policy.role_of(""));
  EXPECT_FALSE(policy.role_of(control.substr(1)));
  EXPECT_FALSE(policy.role_of(control + "0"));
  EXPECT_FALSE(AccessPolicy(at("8600"), "rigpc").role_of(control)) << "each start has its own";
}

TEST(ConsoleAccess, TokensAreLongAndNeverTheSame) {
  EXPECT_THAT(new_token(), testing::MatchesRegex("[0-9a-f]{32}"));
  EXPECT_NE(new_token(), new_token());
  EXPECT_TRUE(same_secret("abc", "abc"));
  EXPECT_FALSE(same_secret("abc", "abd"));
  EXPECT_FALSE(same_secret("abc", "ab"));
}

TEST(ConsoleAccess, TheTokenIsFoundInEitherHeader) {
  EXPECT_EQ(token_in("Bearer x1", ""), "x1");
  EXPECT_EQ(token_in("", "diastole, token.x2"), "x2");
  EXPECT_EQ(token_in("", "token.x3,diastole"), "x3");
  EXPECT_EQ(token_in("Basic x", "diastole,, ,"), "");
  EXPECT_EQ(token_in("", ""), "");
}

TEST(ConsolePage, EveryFileThatItNamesIsThereAndNoneComesFromElsewhere) {
  for (const PageFile& file : page_files()) {
    EXPECT_FALSE(file.text.empty()) << file.path;
    if (file.path.starts_with("/uplot") || file.path.ends_with("licence.txt") || file.path == "/icon.svg")
      continue;
    for (const char* elsewhere : {"http://", "https://", "url(//", "src=\"//"})
      EXPECT_EQ(file.text.find(elsewhere), std::string_view::npos) << file.path << " names another place";
  }
  for (const char* path : {"/", "/console.css", "/console.js", "/daemon.js", "/dialogs.js", "/trace.js",
                           "/icon.svg", "/inter.woff2", "/uplot.js", "/uplot.css"})
    EXPECT_NE(find_page_file(path), nullptr) << path;
  EXPECT_EQ(find_page_file("/../rig.toml"), nullptr);
}

}  // namespace
}  // namespace diastole::web
