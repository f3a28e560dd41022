#pragma once
// One session with application or bootloader, as far as an update needs it: requests and their answers.

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "host/transport/byte_line.hpp"
#include "host/transport/clock.hpp"
#include "protocol/wire/messages.hpp"
#include "protocol/wire/reliable_link.hpp"

namespace diastole {

class UpdateLink {
 public:
  /// Both outlive this.
  UpdateLink(Clock& clock, ByteLine& line);

  /// Begins a new session; false if nobody answers in time. What was asked before is forgotten.
  bool open(uint64_t patience_ns);
  /// True while the session lasts. A reset of the controller ends it, but shows only when something is sent.
  [[nodiscard]] bool is_open() const;

  /// Sends a request and returns its number; nothing if the line does not take it in time.
  template <class Request>
  std::optional<uint16_t> post(Request request);
  /// The answer to request `number`; nothing if it does not come in time or the session ends.
  template <class Answer>
  std::optional<Answer> await(uint16_t number, uint64_t patience_ns);
  template <class Answer, class Request>
  std::optional<Answer> ask(Request request, uint64_t patience_ns) {
    const auto number = post(request);
    return number ? await<Answer>(*number, patience_ns) : std::nullopt;
  }

  /// Repeats StayInBootloader without pause, for a controller that is being reset by hand.
  void flood_stay(uint64_t time_ns);
  void pause(uint64_t time_ns);

 private:
  static constexpr uint64_t step_ns = 1'000'000;

  void turn();
  void hear(const wire::Received& received);
  [[nodiscard]] bool alive() const { return !line_.lost(); }
  template <class Answer>
  std::vector<Answer>& heard();

  Clock& clock_;
  ByteLine& line_;
  wire::ReliableLink link_{wire::ReliableLink::Role::host};
  uint16_t session_;
  uint16_t last_request_ = 0;
  std::vector<wire::Hello> hellos_;
  std::vector<wire::ImageReport> reports_;
  std::vector<wire::UpdateAnswer> answers_;
};

template <class Answer>
std::vector<Answer>& UpdateLink::heard() {
  if constexpr (std::is_same_v<Answer, wire::Hello>) return hellos_;
  if constexpr (std::is_same_v<Answer, wire::ImageReport>) return reports_;
  if constexpr (std::is_same_v<Answer, wire::UpdateAnswer>) return answers_;
}

template <class Request>
std::optional<uint16_t> UpdateLink::post(Request request) {
  constexpr uint64_t patience_ns = 5'000'000'000;
  request.request_id = ++last_request_;
  std::array<uint8_t, wire::kMaxPayloadBytes> memory{};
  const auto bytes = wire::encode(request, memory);
  const uint64_t end_ns = clock_.now_ns() + patience_ns;
  while (!link_.send(Request::kType, bytes)) {
    if (!is_open() || clock_.now_ns() >= end_ns) return {};
    turn();
  }
  return request.request_id;
}

template <class Answer>
std::optional<Answer> UpdateLink::await(uint16_t number, uint64_t patience_ns) {
  const uint64_t end_ns = clock_.now_ns() + patience_ns;
  while (true) {
    for (auto answer = heard<Answer>().begin(); answer != heard<Answer>().end(); ++answer) {
      if (answer->request_id != number) continue;
      const Answer found = *answer;
      heard<Answer>().erase(answer);
      return found;
    }
    if (!is_open() || clock_.now_ns() >= end_ns) return {};
    turn();
  }
}

}  // namespace diastole
