/// The memory of a process that does one thing and ends.
#pragma once

namespace mbcosim::cli {

/// Memory that is freed stays with the process, and it comes in huge pages where the kernel gives
/// them on request (`madvise` in /sys/kernel/mm/transparent_hugepage/enabled): getting pages of
/// 4 KB one by one takes longer than the first iterations of a model of some thousand unknowns.
/// For that the heap gets half as many addresses as the machine has memory, and large arrays lie
/// in it, too. Under a limit on addresses or data (setrlimit) pages stay small, and large arrays
/// have mappings of their own. Nothing happens with another allocator than glibc's.
void keep_heap();

/// Gives back what is free now: after a phase that took much.
void trim_heap();

}  // namespace mbcosim::cli
