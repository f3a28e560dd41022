#include "host/flash/updater.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host/flash/update_link.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/wire/wire_text.hpp"

namespace diastole {
namespace {

constexpr uint64_t ms = 1'000'000;  // ns
constexpr uint64_t answer_timeout = 1'500 * ms;
constexpr uint64_t erase_timeout = 8'000 * ms;
constexpr uint64_t write_timeout = 8'000 * ms;
constexpr uint64_t reset_timeout = 4'000 * ms;
constexpr uint64_t rescue_timeout = 15'000 * ms;
constexpr uint64_t while_it_resets = 60 * ms;
/// Bootloaders of before take a bare header.
constexpr wire::FirmwareVersion signing_since{1, 1, 0};

wire::FirmwareVersion version_of(const wire::Hello& hello) {
  return {hello.version_major, hello.version_minor, hello.version_patch};
}

/// The list's text with the answer's value in place of "{}", in the unit that a person expects.
std::string explanation(const wire::UpdateAnswer& answer) {
  std::string text(wire::update_outcome_explanation(answer.outcome));
  std::string value = std::to_string(answer.value);
  if (answer.outcome == wire::UpdateOutcome::older_version)
    value = fmt::format("{}.{}.{}", answer.value >> 16, answer.value >> 8 & 0xff, answer.value & 0xff);
  if (answer.outcome == wire::UpdateOutcome::wrong_slot) value = fmt::format("0x{:08x}", answer.value);
  if (const auto at = text.find("{}"); at != std::string::npos) text.replace(at, 2, value);
  return text;
}

/// One call of flash_controller.
class Updater {
 public:
  Updater(Clock& clock, ByteLine& line, std::string port, const UpdateFile& file,
          const UpdateOptions& options)
      : link_(clock, line), port_(std::move(port)), file_(file), options_(options) {}

  UpdateResult flash() {
    const FoundController found = find_controller();
    if (!wanted(found)) return result_;
    if (options_.dry_run) {
      result_.end = UpdateEnd::dry_run;
      return result_;
    }
    bootloader_ = version_of(found.bootloader ? found.hello : enter_bootloader());
    if (bootloader_ < signing_since)
      options_.say("its bootloader knows no signatures: flash the new one by SWD (docs/firmware.md)");
    if (!upload(image_for_free_slot())) {
      result_.end = UpdateEnd::stopped;
      return result_;
    }
    result_.verified = true;
    options_.say("verified by the controller; starting it");
    confirm();
    return result_;
  }

 private:
  struct FoundController {
    wire::Hello hello;
    bool bootloader = false;
  };

  FoundController find_controller() {
    if (const auto found = greet(answer_timeout)) return *found;
    options_.say(
        fmt::format("{} does not answer. Reset the controller now, or switch it off and on: for {} s its "
                    "bootloader is called.",
                    port_, rescue_timeout / (1'000 * ms)));
    for (uint64_t waited = 0; waited < rescue_timeout; waited += 500 * ms) {
      link_.flood_stay(400 * ms);
      if (const auto found = greet(100 * ms)) return *found;
      if (options_.stop_asked()) break;
    }
    fail("does not answer, and its bootloader neither",
         "Check cable, power and --baud; a board without this bootloader is flashed once by SWD "
         "(docs/firmware.md).");
  }
  std::optional<FoundController> greet(uint64_t timeout_ns) {
    if (!link_.open(timeout_ns)) return {};
    const auto hello =
        link_.ask<wire::Hello>(wire::HelloRequest{.schema_hash = wire::kSchemaHash}, answer_timeout);
    if (!hello) return {};
    return FoundController{*hello, hello->schema_hash == wire::kBootloaderSchema};
  }
  bool wanted(const FoundController& found) {
    if (file_.board_id != found.hello.board_id) {
      throw InputError({file_.file, "board id",
                        fmt::format("is for board {}, and the controller is board {}", file_.board_id,
                                    found.hello.board_id),
                        "Take the image that was built for this board."});
    }
    if (found.bootloader) {
      options_.say("the controller waits in its bootloader");
      return true;
    }
    result_.before = version_of(found.hello);
    const auto running = report_of(wire::ImageSlot::none);
    options_.say(fmt::format("the controller runs {}, the file holds {}", in_words(*result_.before),
                             in_words(file_.version)));
    if (running && running->build_id == file_.build_id && running->standing == wire::ImageState::confirmed &&
        !options_.force) {
      result_.end = UpdateEnd::already_there;
      result_.held_bytes = running->code_bytes;
      result_.verified = true;
      return false;
    }
    if (file_.version < *result_.before && !options_.allow_older) {
      throw InputError({file_.file, "version",
                        fmt::format("{} is older than {}, which the controller runs", in_words(file_.version),
                                    in_words(*result_.before)),
                        "Give --allow-older if that is meant."});
    }
    return true;
  }
  wire::Hello enter_bootloader() {
    const auto answer = answer_to(wire::EnterBootloader{}, answer_timeout, "enter its bootloader");
    if (answer.outcome != wire::UpdateOutcome::done)
      fail("refused: " + explanation(answer), std::string(wire::update_outcome_remedy(answer.outcome)));
    for (uint64_t waited = 0; waited < reset_timeout; waited += 100 * ms) {
      link_.pause(while_it_resets);
      const auto found = greet(100 * ms);
      if (found && found->bootloader) return found->hello;
    }
    fail("did not come back in its bootloader", "Reset it and give the same command again.");
  }
  const SlotImage& image_for_free_slot() {
    const auto ask = [&](wire::ImageSlot slot) {
      const auto report = report_of(slot);
      if (!report) fail("does not tell what its slots hold", "Reset it and give the same command again.");
      return *report;
    };
    const wire::ImageReport free = ask(ask(wire::ImageSlot::a).free_slot);
    const auto image = std::ranges::find_if(
        file_.images, [&](const SlotImage& each) { return each.header.link_address == free.link_address; });
    if (image != file_.images.end()) return *image;
    throw InputError(
        {file_.file, "images",
         fmt::format("none is linked for address 0x{:08x}, where the free slot lies", free.link_address),
         "Take the image that was built for this board."});
  }
  std::optional<wire::ImageReport> report_of(wire::ImageSlot slot) {
    return link_.ask<wire::ImageReport>(wire::ImageQuery{.slot = slot}, answer_timeout);
  }
  /// False if it was stopped.
  bool upload(const SlotImage& image) {
    result_.image_bytes = static_cast<uint32_t>(image.code.size());
    bool stopped = false;
    wire::UpdateOutcome outcome = send_image(image, stopped);
    if (outcome != wire::UpdateOutcome::done) {
      // Remains of an interrupted update may not fit; the controller has dropped them.
      options_.say("what was there does not fit; sending all of it");
      outcome = send_image(image, stopped);
    }
    if (outcome != wire::UpdateOutcome::done) refused({.outcome = outcome, .value = result_.held_bytes});
    const auto started = answer_to(wire::StartImage{}, answer_timeout, "start the image");
    if (!stopped && started.outcome != wire::UpdateOutcome::done) refused(started);
    return !stopped;
  }
  /// Begin, data, finish. An answer that is not `done` ends it.
  wire::UpdateOutcome send_image(const SlotImage& image, bool& stopped) {
    using enum wire::UpdateOutcome;
    wire::BeginUpdate begin;
    begin.allow_older = options_.allow_older || options_.force ? 1 : 0;
    std::ranges::copy(wire::encode(image.header), begin.header.begin());
    if (bootloader_ >= signing_since) {
      begin.header_bytes = wire::kSignedHeaderBytes;
      std::ranges::copy(wire::encode(image.signature), begin.header.begin() + wire::kImageSignatureAt);
    }
    const auto begun = answer_to(begin, erase_timeout, "make room for the image");
    if (begun.outcome == flash_failed) return flash_failed;
    if (begun.outcome != done) refused(begun);
    if (begun.held_bytes > 0) options_.say(fmt::format("{} bytes are there already", begun.held_bytes));
    const auto total = static_cast<uint32_t>(image.code.size());
    result_.held_bytes = begun.held_bytes;
    // One piece at a time: while the controller writes it (up to 5 ms), it hears nothing.
    while (result_.held_bytes < total) {
      if (options_.stop_asked()) {
        stopped = true;
        return done;
      }
      wire::UpdateData data;
      data.offset = result_.held_bytes;
      data.count = static_cast<uint8_t>(std::min<size_t>(wire::UpdateData::kMaxCount, total - data.offset));
      std::copy_n(image.code.begin() + data.offset, data.count, data.data.begin());
      result_.sent_bytes += data.count;
      const auto answer = answer_to(data, write_timeout, "take the image");
      if (answer.outcome == flash_failed) return flash_failed;
      if (answer.outcome != done) refused(answer);
      result_.held_bytes = answer.held_bytes;
      options_.progress(result_.held_bytes, total);
    }
    const auto finished = answer_to(wire::FinishUpdate{}, answer_timeout, "verify the image");
    if (finished.outcome == not_verified) return not_verified;
    if (finished.outcome != done) refused(finished);
    return done;
  }
  void confirm() {
    std::optional<FoundController> found;
    for (uint64_t waited = 0; waited < reset_timeout && !found; waited += 100 * ms) {
      link_.pause(while_it_resets);
      found = greet(100 * ms);
    }
    constexpr const char* remedy = "It keeps its former firmware; the image does not work on this board.";
    if (!found) fail("does not answer with the new firmware", remedy);
    const auto running = report_of(wire::ImageSlot::none);
    const bool expected = !found->bootloader && version_of(found->hello) == file_.version && running &&
                          running->build_id == file_.build_id;
    if (!expected) {
      fail(fmt::format("did not come up with the new firmware: it has returned to {}",
                       found->bootloader ? "its bootloader" : in_words(version_of(found->hello))),
           remedy);
    }
    const auto confirmed =
        answer_to(wire::ConfirmImage{.build_id = file_.build_id}, answer_timeout, "confirm the image");
    if (confirmed.outcome != wire::UpdateOutcome::done) refused(confirmed);
  }
  wire::UpdateAnswer answer_to(const auto& request, uint64_t timeout_ns, const char* action) {
    if (const auto answer = link_.ask<wire::UpdateAnswer>(request, timeout_ns)) return *answer;
    fail(fmt::format("fell silent when it was to {}", action),
         "Check cable and power and give the same command again: what was sent stays, and it goes on from "
         "there.");
  }
  [[noreturn]] void refused(const wire::UpdateAnswer& answer) const {
    using enum wire::UpdateOutcome;
    const std::string problem = explanation(answer);
    const std::string remedy(wire::update_outcome_remedy(answer.outcome));
    switch (answer.outcome) {
      case bad_header:
      case wrong_board:
      case wrong_slot:
      case too_long:
      case older_version:
      case not_signed:
      case wrong_signature:
      case rolled_back:
        throw InputError({file_.file, "", "the controller refuses it: " + problem, remedy});
      default:
        fail("refused: " + problem, remedy);
    }
  }
  [[noreturn]] void fail(std::string problem, std::string remedy) const {
    throw HardwareError("controller at " + port_, std::move(problem), std::move(remedy));
  }

  UpdateLink link_;
  std::string port_;
  const UpdateFile& file_;
  const UpdateOptions& options_;
  UpdateResult result_;
  wire::FirmwareVersion bootloader_;
};

}  // namespace

UpdateResult flash_controller(Clock& clock, ByteLine& line, const std::string& port, const UpdateFile& file,
                              const UpdateOptions& options) {
  return Updater(clock, line, port, file, options).flash();
}

}  // namespace diastole
