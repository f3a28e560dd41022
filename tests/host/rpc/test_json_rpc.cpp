#include "host/rpc/json_rpc.hpp"

#include <gmock/gmock.h>

#include <random>

#include "protocol/contract/input_error.hpp"
#include "tests/host/bench/scratch.hpp"

namespace diastole::rpc {
namespace {

using nlohmann::json;

Code refusal_of(std::string_view line) {
  json id;
  try {
    (void)parse_request(line, id);
  } catch (const Error& error) {
    return error.code;
  }
  return Code{0};
}

TEST(JsonRpc, ARequestIsTakenApart) {
  json id;
  const Request request = parse_request(R"({"jsonrpc":"2.0","id":7,"method":"rig.status"})", id);
  EXPECT_EQ(request.id, 7);
  EXPECT_EQ(request.method, "rig.status");
  EXPECT_TRUE(request.params.is_object());
}

TEST(JsonRpc, MalformedInputIsRefusedWithTheRightCode) {
  EXPECT_EQ(refusal_of(""), Code::parse_error);
  EXPECT_EQ(refusal_of("{"), Code::parse_error);
  EXPECT_EQ(refusal_of("\xff\xfe"), Code::parse_error);
  EXPECT_EQ(refusal_of("[]"), Code::invalid_request);
  EXPECT_EQ(refusal_of("7"), Code::invalid_request);
  EXPECT_EQ(refusal_of("{}"), Code::invalid_request);
  EXPECT_EQ(refusal_of(R"({"jsonrpc":"1.0","id":1,"method":"x"})"), Code::invalid_request);
  EXPECT_EQ(refusal_of(R"({"jsonrpc":"2.0","method":"x"})"), Code::invalid_request);
  EXPECT_EQ(refusal_of(R"({"jsonrpc":"2.0","id":{},"method":"x"})"), Code::invalid_request);
  EXPECT_EQ(refusal_of(R"({"jsonrpc":"2.0","id":1,"method":5})"), Code::invalid_request);
  EXPECT_EQ(refusal_of(R"({"jsonrpc":"2.0","id":1,"method":"x","params":[1]})"), Code::invalid_params);
  EXPECT_EQ(refusal_of(std::string(100'000, '[')), Code::parse_error);
}

TEST(JsonRpc, RandomBytesAndTruncationsOnlyEverRaiseItsOwnError) {
  std::mt19937 random(5);
  const std::string good = R"({"jsonrpc":"2.0","id":"a","method":"run.start","params":{"file":"x"}})";
  for (int i = 0; i < 5000; ++i) {
    std::string line = good.substr(0, random() % (good.size() + 1));
    for (unsigned flips = random() % 4; flips > 0 && !line.empty(); --flips)
      line[random() % line.size()] = static_cast<char>(random());
    EXPECT_NO_THROW((void)refusal_of(line));
  }
}

TEST(JsonRpc, ErrorsCrossTheSocketUnchanged) {
  const InputFault fault{"gel.toml", "segment[0]", "the controller refuses it", "Reduce stroke_mL."};
  const std::string line = error_line(3, std::make_exception_ptr(InputError(fault)));
  EXPECT_EQ(message_of<InputError>([&] { (void)parse_answer(line, 3); }), InputError(fault).what());
  const HardwareError broken("controller at /dev/ttyACM0", "does not answer", "Check the cable.");
  const std::string other = error_line(4, std::make_exception_ptr(broken));
  EXPECT_EQ(message_of<HardwareError>([&] { (void)parse_answer(other, 4); }), broken.what());
  EXPECT_EQ(parse_answer(result_line(5, {{"a", 1}}), 5), json({{"a", 1}}));
  EXPECT_THROW((void)parse_answer(result_line(5, 1), 6), Error);
}

TEST(JsonRpc, AnErrorOfUnknownFormIsAnErrorOfOurs) {
  for (const char* error :
       {R"({"code":"x"})", R"({"code":-4e22})", R"({"message":1})", R"({"code":-32001,"data":{"file":1}})"}) {
    const std::string line = std::string(R"({"jsonrpc":"2.0","id":1,"error":)") + error + "}";
    EXPECT_THROW((void)parse_answer(line, 1), Error) << line;
  }
}

TEST(JsonRpc, ALineThatIsNestedTooDeeplyIsRefused) {
  const auto nested = [](size_t depth) {
    return R"({"jsonrpc":"2.0","id":1,"method":"m","params":{"a":)" + std::string(depth, '[') +
           std::string(depth, ']') + "}}";
  };
  json id;
  EXPECT_NO_THROW((void)parse_request(nested(20), id));
  EXPECT_THROW((void)parse_request(nested(most_depth), id), Error);
  EXPECT_THROW((void)parse_request(nested(most_line_bytes / 2 - 100), id), Error);
  EXPECT_THROW((void)parse_answer(nested(most_line_bytes / 2 - 100), 1), Error);
}

}  // namespace
}  // namespace diastole::rpc
