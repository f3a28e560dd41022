#pragma once
// The daemon's log on standard error: with date and level for a person or a file, with the level as journald
// reads it (sd-daemon(3): "<4>text") when standard error is a stream of the journal.

namespace diastole {

void set_up_daemon_log();

}  // namespace diastole
