// A processor fault of the emulated chip, from its registers to the words of `diastole blackbox --elf`. Between them stands a socket
// that answers what the daemon would.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <thread>

#include "host/rpc/json_rpc.hpp"
#include "host/rpc/rig_json.hpp"
#include "host/transport/descriptor.hpp"
#include "tests/flow/programs.hpp"
#include "tests/tools/sim_board/chip_bench.hpp"

namespace diastole::faults {
namespace {

using namespace sim_board_test;
using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

/// Answers every connection's one request with `result`, until it is destroyed.
class AnsweringSocket {
 public:
  AnsweringSocket(const std::string& path, const json& result)
      : listener_(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
    EXPECT_EQ(::bind(listener_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(::listen(listener_.get(), 8), 0);
    thread_ = std::jthread([this, result] {
      for (int accepted = 0; (accepted = ::accept(listener_.get(), nullptr, nullptr)) >= 0;) {
        const Descriptor connection(accepted);
        std::string request;
        for (char next = 0; ::read(connection.get(), &next, 1) == 1 && next != '\n';)
          request += next;
        const std::string answer = rpc::result_line(json::parse(request).at("id"), result);
        (void)::send(connection.get(), answer.data(), answer.size(), MSG_NOSIGNAL);
      }
    });
  }
  ~AnsweringSocket() { ::shutdown(listener_.get(), SHUT_RDWR); }
  AnsweringSocket(const AnsweringSocket&) = delete;
  AnsweringSocket& operator=(const AnsweringSocket&) = delete;

 private:
  Descriptor listener_;
  std::jthread thread_;
};

TEST(CrashPlaces, AreNamedByTheFirmwaresSymbols) {
  if (!std::filesystem::exists(sim_board_test::firmware))
    GTEST_SKIP() << "no " << sim_board_test::firmware << ": build the preset `firmware` first";
  ChipBench bench;
  bench.connect();
  bench.patch("USART3_IRQHandler", {0xde00});  // udf
  bench.board().send(std::vector<uint8_t>{0});
  bench.pass(5 * ms);
  bench.restore();
  bench.connect(1'500);
  const json answer =
      as_json(BlackBox{bench.client.black_box(), static_cast<double>(bench.client.hello().tick_rate_Hz)});
  const flow::Workplace place;
  const AnsweringSocket socket((place / "socket").string(), answer);
  const auto black_box = [&](const std::vector<std::string>& more) {
    std::vector<std::string> whole{"diastole", "blackbox", "--socket", (place / "socket").string()};
    whole.insert(whole.end(), more.begin(), more.end());
    return flow::run(place, whole);
  };
  const flow::Ended named = black_box({"--elf", sim_board_test::firmware});
  EXPECT_EQ(named.exit_code, 0) << named.err;
  EXPECT_THAT(named.out, HasSubstr(" in USART3_IRQHandler\n"));
  EXPECT_THAT(black_box({}).out, Not(HasSubstr("USART3_IRQHandler")));
  const json document = black_box({"--elf", sim_board_test::firmware, "--json"}).json();
  for (const json& entry : document.at("entries")) {
    if (entry.value("register", "") != "pc") continue;
    EXPECT_EQ(entry.at("symbol"), "USART3_IRQHandler");
  }
  const flow::Ended no_elf = black_box({"--elf", DIASTOLE_SOURCE_DIR "/README.md"});
  EXPECT_EQ(no_elf.exit_code, 2);
  EXPECT_THAT(no_elf.err, HasSubstr("is no ELF file"));
}

}  // namespace
}  // namespace diastole::faults
