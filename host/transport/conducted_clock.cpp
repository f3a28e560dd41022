#include "host/transport/conducted_clock.hpp"

#include <algorithm>
#include <cerrno>

#include "host/transport/unix_socket.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

constexpr int longest_wait_ms = 1000;

/// Moves all bytes of a record through `transfer` (read or write); false if the other end is gone.
template <typename Transfer>
bool transfer_all(std::byte* bytes, size_t size, Transfer transfer) {
  for (size_t done = 0; done < size;) {
    const ssize_t moved = transfer(bytes + done, size - done);
    if (moved < 0 && errno == EINTR) continue;
    if (moved <= 0) return false;
    done += static_cast<size_t>(moved);
  }
  return true;
}

}  // namespace

ConductedClock::ConductedClock(const std::string& path) : path_(path), socket_(connect_unix_socket(path)) {
  now_ns_ = ask({}).now_ns;
}

uint64_t ConductedClock::now_ns() {
  conductor::Record record{};
  while (::recv(socket_.get(), record.data(), record.size(), MSG_DONTWAIT | MSG_PEEK) ==
         static_cast<ssize_t>(record.size())) {
    (void)::recv(socket_.get(), record.data(), record.size(), 0);
    take(conductor::decode_advanced(record));
  }
  return now_ns_;
}

void ConductedClock::take(const conductor::Advanced& told) { now_ns_ = std::max(now_ns_, told.now_ns); }

void ConductedClock::sleep_until_ns(uint64_t until_ns, ByteLine* line) {
  if (line != nullptr) line->flush(longest_wait_ms);
  const auto answer = ask({until_ns, line == nullptr ? 0 : line->written_total()});
  take(answer);
  if (line != nullptr && answer.serial_bytes_sent_total > sent_before_opening_) {
    line->wait_received(answer.serial_bytes_sent_total - sent_before_opening_, longest_wait_ms);
  }
}

void ConductedClock::line_opened(ByteLine& line) {
  sent_before_opening_ = ask({0, line.written_total()}).serial_bytes_sent_total;
}

conductor::Advanced ConductedClock::ask(const conductor::Advance& question) {
  conductor::Record record = conductor::encode(question);
  const int fd = socket_.get();
  bool told = transfer_all(record.data(), record.size(),
                           [&](std::byte* at, size_t size) { return ::send(fd, at, size, MSG_NOSIGNAL); });
  while (told) {
    told = transfer_all(record.data(), record.size(),
                        [&](std::byte* at, size_t size) { return ::read(fd, at, size); });
    const conductor::Advanced answer = conductor::decode_advanced(record);
    if (told && answer.serial_bytes_sent_total != conductor::unasked) return answer;
    if (told) take(answer);
  }
  throw HardwareError(path_, "the simulated rig that conducts time has gone", "Start the simulation again.");
}

}  // namespace diastole
