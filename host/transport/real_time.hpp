#pragma once
// Priority over other programs.

namespace diastole {

inline constexpr int instrument_priority = 50;  ///< asks nobody, and loses a sample when late
inline constexpr int rig_priority = 40;         ///< owes the controller a heart-beat every lease

/// Asks for SCHED_FIFO at this priority for the calling thread, where the system allows it (CAP_SYS_NICE, or
/// RLIMIT_RTPRIO); without effect elsewhere. Threads that it starts have none of it.
void ask_for_real_time(int priority);

}  // namespace diastole
