#pragma once
// Requests to the controller and their answers, one at a time.

#include <fmt/format.h>

#include <optional>
#include <string>
#include <type_traits>
#include <variant>

#include "host/controller/controller_link.hpp"
#include "host/controller/controller_words.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/wire/messages.hpp"
#include "protocol/wire/wire_text.hpp"

namespace diastole {

class Requests {
 public:
  using Answer = std::variant<wire::Ack, wire::Nak, wire::Hello, wire::Status, wire::SettingsReport,
                              wire::BlackBoxReport, wire::SelfTestReport>;

  /// `port` is for messages; clock and link outlive this.
  Requests(Clock& clock, ControllerLink& link, const std::string& port)
      : clock_(clock), link_(link), device_("controller at " + port) {}

  /// Sends without waiting; the answer, if it is a refusal, comes as an event. Returns the request's number.
  template <class Message>
  uint16_t post(Message message) {
    if (!link_.has_line()) return 0;
    message.request_id = next_id_++;
    link_.send(message);
    link_.transmit();
    return message.request_id;
  }
  /// Sends and waits: the controller's refusal, or none. Throws HardwareError if no answer comes.
  template <class Message>
  std::optional<wire::Nak> refusal_of(const Message& message) {
    const Answer answer = answer_to(message);
    const auto* nak = std::get_if<wire::Nak>(&answer);
    return nak != nullptr ? std::optional(*nak) : std::nullopt;
  }
  /// Sends and waits; throws HardwareError with the refusal in words.
  template <class Message>
  void demand(const Message& message) {
    if (const auto nak = refusal_of(message)) refuse(*nak);
  }
  /// The answer of this type; throws HardwareError with the refusal in words, or that says `problem` if another comes.
  template <class Reply, class Message>
  Reply ask(const Message& message, const char* problem,
            const char* remedy = "Restart the daemon if it persists.") {
    const Answer answer = answer_to(message);
    if (const auto* reply = std::get_if<Reply>(&answer)) return *reply;
    if (const auto* nak = std::get_if<wire::Nak>(&answer)) refuse(*nak);
    fail(problem, remedy);
  }

  [[nodiscard]] bool awaiting() const { return awaited_.has_value(); }
  /// Gives up the answer that is awaited.
  void forget() { awaited_.reset(); }
  /// Whether this is the answer that is awaited, which is then kept.
  template <class Message>
  bool take(const Message& message) {
    bool matches = awaited_ == message.request_id;
    if constexpr (std::is_same_v<Message, wire::Nak>) {
      // A request that cannot be decoded is refused without its number.
      matches = matches || (awaited_ && message.refusal == wire::Refusal::malformed &&
                            message.request_id == 0 && message.request_type == awaited_type_);
    }
    if (!matches) return false;
    awaited_.reset();
    answer_ = message;
    return true;
  }

  [[noreturn]] void fail(std::string problem, std::string remedy) const {
    throw HardwareError(device_, std::move(problem), std::move(remedy));
  }
  [[noreturn]] void refuse(const wire::Nak& nak) const {
    const std::string limit = nak.refusal == wire::Refusal::limit_exceeded
                                  ? fmt::format(" (limit {}, asked {}, allowed {})",
                                                wire::limit_name(nak.limit), nak.asked, nak.allowed)
                                  : "";
    fail(fmt::format("refused: {}{}", wire::refusal_explanation(nak.refusal), limit),
         remedy_for(nak.refusal));
  }

 private:
  static constexpr uint64_t answer_timeout_ns = 1'000'000'000;

  template <class Message>
  Answer answer_to(const Message& message) {
    require_line();
    awaited_type_ = static_cast<uint8_t>(Message::kType);
    awaited_ = post(message);
    await();
    return answer_;
  }
  void require_line() const {
    if (!link_.has_line())
      fail("is not connected", "Check cable and power; the daemon reconnects by itself.");
  }
  void await() {
    const uint64_t end_ns = clock_.now_ns() + answer_timeout_ns;
    while (awaited_ && link_.has_line() && clock_.now_ns() < end_ns)
      link_.turn();
    if (!link_.has_line()) fail("the line broke", "Check the cable; the daemon reconnects by itself.");
    if (!awaited_) return;
    awaited_.reset();
    fail("did not answer in time", "Check the cable and the baud rate.");
  }

  Clock& clock_;
  ControllerLink& link_;
  std::string device_;
  uint16_t next_id_ = 1;
  std::optional<uint16_t> awaited_;
  uint8_t awaited_type_ = 0;
  Answer answer_;
};

}  // namespace diastole
