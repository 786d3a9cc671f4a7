/// The memory of a process that does one thing and ends.
#pragma once

namespace mbcosim::cli {

/// Gets the pages of the stack that most runs use and of the first half MB of the heap at once, as
/// the program got those of its code before `main`: one by one, as they are touched, they make a
/// small run take up to a sixth longer. Memory that is freed stays with the process. Nothing
/// happens with another allocator than glibc's.
void begin_heap();

/// For large models: memory comes in huge pages, too, where the kernel gives them on request
/// (`madvise` in /sys/kernel/mm/transparent_hugepage/enabled): getting pages of 4 KB one by one
/// takes longer than the first iterations of a model of some thousand unknowns. For that the heap
/// gets half as many addresses as the machine has memory, and large arrays lie in it, too. Under a
/// limit on addresses or data (setrlimit) pages stay small, and large arrays have mappings of their
/// own.
void keep_heap();

/// Gives back what is free now: after a phase that took much.
void trim_heap();

}  // namespace mbcosim::cli
