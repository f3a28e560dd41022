#include "host/controller/requests.hpp"

#include <fmt/format.h>

#include "host/controller/refusals.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/wire/wire_text.hpp"

namespace diastole {
namespace {

constexpr uint64_t answer_patience_ns = 1'000'000'000;

}  // namespace

void Requests::fail(std::string problem, std::string remedy) const {
  throw HardwareError(device_, std::move(problem), std::move(remedy));
}

void Requests::refuse(const wire::Nak& nak) const {
  const std::string limit = nak.refusal == wire::Refusal::limit_exceeded
                                ? fmt::format(" (limit {}, asked {}, allowed {})",
                                              wire::limit_name(nak.limit), nak.asked, nak.allowed)
                                : "";
  fail(fmt::format("refused: {}{}", wire::refusal_explanation(nak.refusal), limit), remedy_for(nak.refusal));
}

void Requests::require_line() const {
  if (!link_.has_line()) fail("is not connected", "Check cable and power; the daemon reconnects by itself.");
}

void Requests::await() {
  const uint64_t end_ns = clock_.now_ns() + answer_patience_ns;
  while (awaited_ && link_.has_line() && clock_.now_ns() < end_ns)
    link_.turn();
  if (!link_.has_line()) fail("the line broke", "Check the cable; the daemon reconnects by itself.");
  if (!awaited_) return;
  awaited_.reset();
  fail("did not answer in time", "Check the cable and the baud rate.");
}

}  // namespace diastole
