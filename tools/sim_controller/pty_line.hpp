#pragma once
// The controller's end of the serial line: the master side of a pseudo-terminal that the daemon opens like a port.
// Nothing here waits.

#include <cstdint>
#include <deque>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace diastole::sim_controller {

class PtyLine {
 public:
  /// Opens the pseudo-terminal and, if `link` is not empty, a symbolic link to it (an old link is replaced;
  /// anything else there is an InputError). Throws HardwareError if the system has no pseudo-terminal left.
  explicit PtyLine(std::filesystem::path link);
  ~PtyLine();
  PtyLine(const PtyLine&) = delete;
  PtyLine& operator=(const PtyLine&) = delete;

  /// The path to open: the link if there is one.
  [[nodiscard]] std::string path() const { return link_.empty() ? device_ : link_.string(); }
  /// Readable when bytes have come; -1 while nobody has the port open (it would be readable all the time).
  [[nodiscard]] int descriptor() const { return open_ ? master_ : -1; }

  /// Looks whether the port was opened or closed meanwhile; at an opening both counts start anew.
  void refresh();
  void restart_counts();

  std::vector<uint8_t> read();
  /// Queues bytes and sends what the line takes; bytes sent to nobody are lost, as on a wire.
  void write(std::span<const uint8_t> bytes);
  void send_queued();

  /// Pulls the plug: whoever has the port open sees a hang-up; nobody can open it until it is plugged in again,
  /// as another device behind the same link.
  void hang_up();
  /// No effect unless it is unplugged. Throws as the constructor does.
  void plug_in();
  [[nodiscard]] bool plugged_in() const { return master_ >= 0; }

  /// Bytes since the port was opened.
  [[nodiscard]] uint64_t received_total() const { return received_total_; }
  [[nodiscard]] uint64_t sent_total() const { return sent_total_; }

 private:
  std::filesystem::path link_;
  int master_ = -1;
  std::string device_;
  bool open_ = false;
  std::deque<uint8_t> queued_;
  uint64_t received_total_ = 0;
  uint64_t sent_total_ = 0;
};

}  // namespace diastole::sim_controller
