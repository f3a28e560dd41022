#include "host/daemon/queued_sink.hpp"

#include <gmock/gmock.h>
#include <spdlog/logger.h>
#include <unistd.h>

#include <array>
#include <memory>
#include <thread>

#include "host/transport/descriptor.hpp"

namespace diastole {
namespace {

using testing::HasSubstr;

struct Pipe {
  Pipe() {
    std::array<int, 2> ends{};
    if (::pipe(ends.data()) != 0) throw std::runtime_error("no pipe");
    reader = Descriptor(ends[0]);
    writer = Descriptor(ends[1]);
  }
  /// To the end of what is written.
  [[nodiscard]] std::string read_all() const {
    std::string all;
    std::array<char, 65536> block{};
    for (ssize_t got = 0; (got = ::read(reader.get(), block.data(), block.size())) > 0;)
      all.append(block.data(), static_cast<size_t>(got));
    return all;
  }
  Descriptor reader, writer;
};

TEST(QueuedSink, EveryLineIsWrittenInOrderBeforeItEnds) {
  Pipe pipe;
  {
    spdlog::logger log("test", std::make_shared<QueuedSink>(pipe.writer.get()));
    log.set_pattern("%v");
    for (int i = 0; i < 100; ++i)
      log.info("line {}", i);
  }
  pipe.writer = Descriptor();
  std::string expected;
  for (int i = 0; i < 100; ++i)
    expected += "line " + std::to_string(i) + "\n";
  EXPECT_EQ(pipe.read_all(), expected);
}

TEST(QueuedSink, AReaderThatIsStuckHoldsNobodyUpAndWhatIsLeftOutIsCounted) {
  Pipe pipe;
  constexpr size_t lines = 3 * QueuedSink::most_waiting;
  auto log = std::make_unique<spdlog::logger>("test", std::make_shared<QueuedSink>(pipe.writer.get()));
  log->set_pattern("%v");
  for (size_t i = 0; i < lines; ++i)
    log->info("{:0100}", i);  // more than a pipe holds: a sink that writes by itself never returns
  std::string all;
  std::thread reader([&] { all = pipe.read_all(); });
  log.reset();
  pipe.writer = Descriptor();
  reader.join();
  EXPECT_THAT(all, HasSubstr("lines of the log were left out"));
  EXPECT_THAT(all, HasSubstr(std::string(100, '0') + "\n"));
  EXPECT_GT(std::ranges::count(all, '\n'), static_cast<std::ptrdiff_t>(QueuedSink::most_waiting));
}

}  // namespace
}  // namespace diastole
