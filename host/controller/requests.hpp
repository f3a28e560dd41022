#pragma once
// Requests to the controller and their answers, one at a time.

#include <optional>
#include <string>
#include <type_traits>
#include <variant>

#include "host/controller/controller_link.hpp"
#include "protocol/wire/messages.hpp"

namespace diastole {

class Requests {
 public:
  using Answer = std::variant<wire::Ack, wire::Nak, wire::Hello, wire::Status, wire::SettingsReport,
                              wire::BlackBoxReport>;

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
  /// The answer of this type; throws HardwareError that says `problem` if another comes.
  template <class Reply, class Message>
  Reply ask(const Message& message, const char* problem,
            const char* remedy = "Restart the daemon if it persists.") {
    const Answer answer = answer_to(message);
    if (const auto* reply = std::get_if<Reply>(&answer)) return *reply;
    fail(problem, remedy);
  }

  [[nodiscard]] bool awaiting() const { return awaited_.has_value(); }
  /// Gives up the answer that is awaited.
  void forget() { awaited_.reset(); }
  /// Whether this is the answer that is awaited, which is then kept.
  template <class Message>
  bool take(const Message& message) {
    bool mine = awaited_ == message.request_id;
    if constexpr (std::is_same_v<Message, wire::Nak>) {
      // A request that cannot be decoded is refused without its number.
      mine = mine || (awaited_ && message.refusal == wire::Refusal::malformed && message.request_id == 0 &&
                      message.request_type == awaited_type_);
    }
    if (!mine) return false;
    awaited_.reset();
    answer_ = message;
    return true;
  }

  [[noreturn]] void fail(std::string problem, std::string remedy) const;
  [[noreturn]] void refuse(const wire::Nak& nak) const;

 private:
  template <class Message>
  Answer answer_to(const Message& message) {
    require_line();
    awaited_type_ = static_cast<uint8_t>(Message::kType);
    awaited_ = post(message);
    await();
    return answer_;
  }
  void require_line() const;
  void await();

  Clock& clock_;
  ControllerLink& link_;
  std::string device_;
  uint16_t next_id_ = 1;
  std::optional<uint16_t> awaited_;
  uint8_t awaited_type_ = 0;
  Answer answer_;
};

}  // namespace diastole
