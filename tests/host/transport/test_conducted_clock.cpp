#include "host/transport/conducted_clock.hpp"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <cstring>
#include <thread>

#include "protocol/contract/input_error.hpp"
#include "tests/host/bench/scratch.hpp"

namespace diastole {
namespace {

TEST(Conductor, TheRecordsAreAsDrawn) {
  const auto record = conductor::encode(conductor::Advance{0x0102030405060708, 0x1112131415161718});
  EXPECT_EQ(record[0], std::byte{0x08});
  EXPECT_EQ(record[7], std::byte{0x01});
  EXPECT_EQ(record[8], std::byte{0x18});
  EXPECT_EQ(conductor::decode_advance(record), (conductor::Advance{0x0102030405060708, 0x1112131415161718}));
}

/// Answers every question with the time asked for, and `serial_bytes` sent.
class Conductor {
 public:
  explicit Conductor(const std::string& path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path, path.c_str(), path.size() + 1);
    listener_ = Descriptor(::socket(AF_UNIX, SOCK_STREAM, 0));
    EXPECT_EQ(::bind(listener_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
    ::listen(listener_.get(), 1);
    thread_ = std::jthread([this] { serve(); });
  }
  std::vector<conductor::Advance> questions;

 private:
  void serve() {
    const Descriptor client(::accept(listener_.get(), nullptr, nullptr));
    uint64_t now_ns = 1000;
    conductor::Record record{};
    while (::recv(client.get(), record.data(), record.size(), MSG_WAITALL) == 16) {
      questions.push_back(conductor::decode_advance(record));
      now_ns = std::max(now_ns, questions.back().until_ns);
      record = conductor::encode(conductor::Advanced{now_ns, 0});
      ::send(client.get(), record.data(), record.size(), MSG_NOSIGNAL);
    }
  }
  Descriptor listener_;
  std::jthread thread_;
};

TEST(ConductedClock, MovesOnlyInSleepAndNeverBack) {
  const Scratch scratch("conductor");
  {
    Conductor conductor(scratch / "c.sock");
    ConductedClock clock(scratch / "c.sock");
    EXPECT_EQ(clock.now_ns(), 1000U);
    clock.sleep_until_ns(5000, nullptr);
    EXPECT_EQ(clock.now_ns(), 5000U);
    clock.sleep_until_ns(100, nullptr);
    EXPECT_EQ(clock.now_ns(), 5000U);
    EXPECT_TRUE(clock.stands_still());
    EXPECT_EQ(conductor.questions.size(), 3U);
  }
  EXPECT_THROW(ConductedClock((scratch / "nobody.sock").string()), HardwareError);
}

TEST(RealClock, ReachesTheTimeAskedFor) {
  RealClock clock;
  const uint64_t until_ns = clock.now_ns() + 2'000'000;
  clock.sleep_until_ns(until_ns, nullptr);
  EXPECT_GE(clock.now_ns() + 100'000, until_ns);
  EXPECT_FALSE(clock.stands_still());
}

}  // namespace
}  // namespace diastole
