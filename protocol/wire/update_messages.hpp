#pragma once
// Replacing the firmware over the line: who runs, into the bootloader, the image in pieces, trial and
// confirmation. The layout of these messages never changes and none of them waits for the schema hashes to
// agree, so that any host can replace any firmware.
//
//   host                                   controller
//   ImageQuery (none)                 →                             application
//                                     ←    ImageReport
//   EnterBootloader                   →
//                                     ←    UpdateAnswer             resets
//   open, ImageQuery (a), (b)         →                             bootloader
//                                     ←    ImageReport, ImageReport
//   BeginUpdate                       →
//                                     ←    UpdateAnswer (held)      erases if need be
//   UpdateData (from held on) …       →
//                                     ←    UpdateAnswer (held) …
//   FinishUpdate                      →
//                                     ←    UpdateAnswer             reads back, verifies
//   StartImage                        →
//                                     ←    UpdateAnswer             resets, tries the new one
//   open, HelloRequest, ImageQuery    →                             new application
//                                     ←    Hello, ImageReport
//   ConfirmImage                      →
//                                     ←    UpdateAnswer

#include <array>
#include <cstddef>
#include <cstdint>

#include "protocol/wire/common_requests.hpp"
#include "protocol/wire/field_codec.hpp"
#include "protocol/wire/image_header.hpp"
#include "protocol/wire/message_type.hpp"
#include "protocol/wire/update.hpp"

namespace diastole::wire {

// Host → application: reset into the bootloader. Refused unless at rest and disarmed;
// the motor is switched off.
//
//   offset size field
//        0    2 request_id                   chosen by the host; the answer repeats it
//
// Example EnterBootloader: 09 00
using EnterBootloader = BareRequest<MessageType::EnterBootloader, 9>;

// Host → application or bootloader: what is in a slot? Answered with ImageReport.
//
//   offset size field
//        0    2 request_id                   chosen by the host; the answer repeats it
//        2    1 slot                         none: the one that runs
//
// Example ImageQuery: 09 00 01
struct ImageQuery {
  static constexpr MessageType kType = MessageType::ImageQuery;
  std::uint16_t request_id = 0;
  ImageSlot slot{};

  static constexpr void layout(auto& self, auto& visit) {
    visit.field("request_id", self.request_id);
    visit.choice("slot", self.slot, kLastImageSlot);
  }
  static constexpr ImageQuery example() { return {.request_id = 9, .slot = ImageSlot::b}; }
};

// Host → application on trial: you work; from now on you are the one to start.
// Repeated, it changes nothing.
//
//   offset size field
//        0    2 request_id                   chosen by the host; the answer repeats it
//        2    8 build_id                     of the image that the host means
//
// Example ConfirmImage: 09 00 88 77 66 55 44 33 22 11
struct ConfirmImage {
  static constexpr MessageType kType = MessageType::ConfirmImage;
  std::uint16_t request_id = 0;
  std::uint64_t build_id = 0;

  static constexpr void layout(auto& self, auto& visit) { DIASTOLE_FIELDS(request_id, build_id); }
  static constexpr ConfirmImage example() { return {.request_id = 9, .build_id = 0x1122334455667788}; }
};

// Host → bootloader: an image for the free slot. If the slot holds the beginning of this very image, it is kept
// and the answer says how many bytes of code are there; otherwise the sector is erased, which takes 1 to 2 s.
//
//   offset size field
//        0    2 request_id                   chosen by the host; the answer repeats it
//        2    1 allow_older                  1: also one older than the confirmed one
//        3    1 header_bytes                 64
//        4   64 header                       image_header.hpp
//
// Example BeginUpdate: 09 00 00 40 44 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00
// 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00 00
// 00 00 00 00 00 00 00 00 8F
struct BeginUpdate {
  static constexpr MessageType kType = MessageType::BeginUpdate;
  std::uint16_t request_id = 0;
  std::uint8_t allow_older = 0;
  std::uint8_t header_bytes = kImageHeaderBytes;
  ImageHeaderBytes header{};

  static constexpr void layout(auto& self, auto& visit) {
    visit.field("request_id", self.request_id);
    visit.field("allow_older", self.allow_older, 0, 1);
    visit.list("header", self.header_bytes, self.header);
  }
  static constexpr BeginUpdate example() {
    BeginUpdate message;
    message.request_id = 9;
    message.header[0] = 0x44;
    message.header[63] = 0x8F;
    return message;
  }
};

// Host → bootloader: the next bytes of code.
//
//   offset size field
//        0    2 request_id                   chosen by the host; the answer repeats it
//        2    4 offset                       from the first byte of code; at most what is held
//        6    1 count                        of bytes; a multiple of 4
//        7    n data
//
// Example UpdateData: 09 00 00 01 00 00 04 01 00 00 20
struct UpdateData {
  static constexpr MessageType kType = MessageType::UpdateData;
  static constexpr std::size_t kMaxCount = 232;
  std::uint16_t request_id = 0;
  std::uint32_t offset = 0;
  std::uint8_t count = 0;
  std::array<std::uint8_t, kMaxCount> data{};

  static constexpr void layout(auto& self, auto& visit) {
    DIASTOLE_FIELDS(request_id, offset);
    visit.list("data", self.count, self.data);
  }
  static constexpr UpdateData example() {
    return {.request_id = 9, .offset = 256, .count = 4, .data = {1, 0, 0, 0x20}};
  }
};

// Host → bootloader: that was all. The image is read back and hashed; if it verifies it is the one to be tried.
//
//   offset size field
//        0    2 request_id                   chosen by the host; the answer repeats it
//
// Example FinishUpdate: 09 00
using FinishUpdate = BareRequest<MessageType::FinishUpdate, 9>;

// Host → bootloader: reset and start what is to be started.
//
//   offset size field
//        0    2 request_id                   chosen by the host; the answer repeats it
//
// Example StartImage: 09 00
using StartImage = BareRequest<MessageType::StartImage, 9>;

// Host → bootloader, repeated without pause while the controller is reset by hand: a bootloader that sees one
// within 30 ms of its start stays, whatever the slots hold. Needs no open session.
//
//   offset size field
//        0    4 word                         "STAY"
//
// Example StayInBootloader: 53 54 41 59
struct StayInBootloader {
  static constexpr MessageType kType = MessageType::StayInBootloader;
  static constexpr std::uint32_t kWord = 0x59415453;
  std::uint32_t word = kWord;

  static constexpr void layout(auto& self, auto& visit) { visit.field("word", self.word, kWord, kWord); }
  static constexpr StayInBootloader example() { return {}; }
};

// Application or bootloader → host. The application knows its own slot only.
//
//   offset size field
//        0    2 request_id                   chosen by the host; the answer repeats it
//        2    1 slot                         none: the bootloader answers for itself
//        3    1 standing                     update.hpp
//        4    1 version_major                of the image; 0 if there is no header
//        5    1 version_minor
//        6    1 version_patch
//        7    8 build_id
//       15    4 code_bytes
//       19    4 held_bytes                   of code that are there
//       23    4 link_address                 of the slot
//       27    1 free_slot                    where an update goes
//
// Example ImageReport: 09 00 01 01 00 01 00 88 77 66 55 44 33 22 11 30 75 00 00 00 04 00 00 00 00 04
// 08 01
struct ImageReport {
  static constexpr MessageType kType = MessageType::ImageReport;
  std::uint16_t request_id = 0;
  ImageSlot slot{};
  ImageState standing{};
  std::uint8_t version_major = 0;
  std::uint8_t version_minor = 0;
  std::uint8_t version_patch = 0;
  std::uint64_t build_id = 0;
  std::uint32_t code_bytes = 0;
  std::uint32_t held_bytes = 0;
  std::uint32_t link_address = 0;
  ImageSlot free_slot{};

  static constexpr void layout(auto& self, auto& visit) {
    visit.field("request_id", self.request_id);
    visit.choice("slot", self.slot, kLastImageSlot);
    visit.choice("standing", self.standing, kLastImageState);
    DIASTOLE_FIELDS(version_major, version_minor, version_patch, build_id, code_bytes, held_bytes,
                    link_address);
    visit.choice("free_slot", self.free_slot, kLastImageSlot);
  }
  static constexpr ImageReport example() {
    return {.request_id = 9,
            .slot = ImageSlot::b,
            .standing = ImageState::incomplete,
            .version_minor = 1,
            .build_id = 0x1122334455667788,
            .code_bytes = 30'000,
            .held_bytes = 1024,
            .link_address = 0x0804'0000,
            .free_slot = ImageSlot::b};
  }
};

// Application or bootloader → host: the answer to every request of an update but ImageQuery.
//
//   offset size field
//        0    2 request_id                   chosen by the host; the answer repeats it
//        2    1 request_type                 MessageType of the request
//        3    1 outcome                      update_outcome_list.inc
//        4    4 held_bytes                   of code that are there
//        8    4 value                        what the outcome speaks of
//
// Example UpdateAnswer: 09 00 33 05 00 00 00 00 02 00 00 00
struct UpdateAnswer {
  static constexpr MessageType kType = MessageType::UpdateAnswer;
  std::uint16_t request_id = 0;
  std::uint8_t request_type = 0;
  UpdateOutcome outcome{};
  std::uint32_t held_bytes = 0;
  std::uint32_t value = 0;

  static constexpr void layout(auto& self, auto& visit) {
    DIASTOLE_FIELDS(request_id, request_type);
    visit.choice("outcome", self.outcome, kLastUpdateOutcome);
    DIASTOLE_FIELDS(held_bytes, value);
  }
  static constexpr UpdateAnswer example() {
    return {.request_id = 9, .request_type = 0x33, .outcome = UpdateOutcome::wrong_board, .value = 2};
  }
};

}  // namespace diastole::wire
