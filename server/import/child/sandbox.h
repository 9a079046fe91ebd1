// server/import/child/sandbox.h - what this process gives up before a parser sees a byte.
#pragma once
#include <cstdint>

#include "core/base/result.h"
#include "server/import/import.h"

namespace spinaltap::importer {

/// At start: no new privileges, death with the parent, no core file, no new files, processes or descriptors to speak
/// of, CPU time, stack.
void limitResources(const ImportLimits& limits);

/// After the input is in memory: address space for `input_bytes` of it and `extra_bytes` more, then a system call
/// filter that leaves memory, writing to the two pipes, clocks and exit. Opening, reading, sockets, processes and exec
/// answer EPERM.
/// @error Unsupported when the kernel refuses the filter: then nothing is parsed. A weaker import is not offered, since
/// the
///        DICOM parser has had memory-safety faults and its input comes from strangers.
[[nodiscard]] Result<void> enterSandbox(const ImportLimits& limits, std::uint64_t input_bytes,
                                        std::uint64_t extra_bytes);

/// Enters the sandbox and tries what it must forbid; prints one line a trial to stdout. 0 when all of them failed.
[[nodiscard]] int testSandbox();

}  // namespace spinaltap::importer
