#include "host/rpc/methods.hpp"

#include <gmock/gmock.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "host/rpc/json_rpc.hpp"
#include "protocol/contract/json_text.hpp"
#include "tests/host/bench/rig_on_paper.hpp"
#include "tests/host/rpc/usual_requests.hpp"

namespace diastole {
namespace {

using nlohmann::json;

/// What a client that sends this reads: {"result"} or {"error"}.
json answer_to(const Method& method, const json& sent) {
  static const RigConfig config = read_rig(std::filesystem::path(DIASTOLE_SOURCE_DIR) / "examples/rig.toml");
  const json params = json::parse(json_text(sent));
  RigOnPaper rig(config);
  int answers = 0;
  std::string line;
  try {
    method.act(rig, params, [&](const std::exception_ptr& error, const json& result) {
      ++answers;
      line = error ? rpc::error_line(1, error) : rpc::result_line(1, result);
    });
    EXPECT_EQ(answers, 1) << method.name;
  } catch (...) {
    EXPECT_EQ(answers, 0) << method.name << " was answered and threw as well";
    line = rpc::error_line(1, std::current_exception());
  }
  return json::parse(line);
}

TEST(Methods, EachCarriesOutItsOrder) {
  for (const Method& method : methods()) {
    ASSERT_TRUE(usual_requests().contains(std::string(method.name))) << method.name;
    const json answer = answer_to(method, usual_requests().at(std::string(method.name)));
    EXPECT_TRUE(answer.contains("result")) << method.name << ": " << answer.dump();
  }
  EXPECT_EQ(methods().size(), usual_requests().size());
}

TEST(Methods, ParametersOfAnyKindAreTakenOrRefusedAsTheClientsFault) {
  const std::vector<json> values{nullptr,
                                 true,
                                 -1,
                                 1e300,
                                 uint64_t{1} << 63U,
                                 "",
                                 "\xff",
                                 json::array(),
                                 json::object(),
                                 json::array({1, json::object()})};
  for (const Method& method : methods()) {
    for (const auto& [name, usual] : usual_requests().at(std::string(method.name)).items()) {
      for (const json& value : values) {
        json params = usual_requests().at(std::string(method.name));
        params[name] = value;
        const json answer = answer_to(method, params);
        if (answer.contains("result")) continue;
        const auto code = static_cast<rpc::Code>(answer["error"]["code"].get<int>());
        EXPECT_TRUE(code == rpc::Code::invalid_params || code == rpc::Code::input_fault)
            << method.name << ", " << name << ": " << answer.dump();
      }
    }
  }
}

TEST(Methods, NumbersThatNoOrderMayHaveAreRefused) {
  const auto is_refused = [](const char* method, const char* name, const json& value) {
    json params = usual_requests().at(method);
    params[name] = value;
    return answer_to(*find_method(method), params).contains("error");
  };
  EXPECT_TRUE(is_refused("rig.jog", "rate_mL_s", 0));
  EXPECT_TRUE(is_refused("rig.jog", "rate_mL_s", 1e300));
  EXPECT_TRUE(is_refused("rig.self_test", "seconds", 1));
  EXPECT_TRUE(is_refused("rig.self_test", "seconds", 1e9));
  EXPECT_TRUE(is_refused("rig.zero", "seconds", -1));
  EXPECT_TRUE(is_refused("rig.calibrate", "channels", json::array({"cavity", "pump"})));
  EXPECT_TRUE(is_refused("rig.calibrate", "channels", json::array({"no such"})));
  EXPECT_TRUE(is_refused("run.trace", "first_row", -1));
  EXPECT_TRUE(is_refused("run.stop", "how", "at once"));
}

TEST(Methods, FactsOfASessionThatSteerATerminalAreRefused) {
  for (const json& session : {json{{"specimen", "gel \x1b[2J"}}, json{{"operator", "J\r"}},
                              json{{"notes", {"warm", "red \x1b[31m"}}}}) {
    json params = usual_requests().at("run.start");
    params["session"] = session;
    const json answer = answer_to(*find_method("run.start"), params);
    ASSERT_TRUE(answer.contains("error")) << session;
    EXPECT_THAT(answer["error"]["message"].get<std::string>(), testing::HasSubstr("control character"));
  }
}

}  // namespace
}  // namespace diastole
