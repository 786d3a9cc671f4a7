#include "durable/build.h"

#include <elf.h>
#include <link.h>

#include <cstdio>
#include <cstring>

namespace mbcosim::server {
namespace {

#ifdef __clang__
constexpr const char* kCompiler = __VERSION__;  // names itself
#else
constexpr const char* kCompiler = "GCC " __VERSION__;
#endif

std::size_t padded(std::size_t size) { return (size + 3) & ~std::size_t{3}; }

/// The build id among the notes of a segment; empty: it has none.
std::string id_among(const char* notes, std::size_t size) {
  constexpr char kOwner[] = "GNU";
  while (size >= sizeof(ElfW(Nhdr))) {
    ElfW(Nhdr) head;
    std::memcpy(&head, notes, sizeof head);
    const std::size_t name = sizeof head, content = name + padded(head.n_namesz);
    const std::size_t end = content + padded(head.n_descsz);
    if (end > size) break;
    if (head.n_type == NT_GNU_BUILD_ID && head.n_namesz == sizeof kOwner &&
        std::memcmp(notes + name, kOwner, sizeof kOwner) == 0) {
      std::string id;
      for (std::size_t i = 0; i < head.n_descsz; ++i) {
        char digits[3];
        std::snprintf(digits, sizeof digits, "%02x",
                      static_cast<unsigned char>(notes[content + i]));
        id += digits;
      }
      return id;
    }
    notes += end;
    size -= end;
  }
  return "";
}

// The program comes first; what it has loaded is not asked.
int take_id(dl_phdr_info* info, std::size_t, void* out) {
  for (int i = 0; i < info->dlpi_phnum; ++i) {
    const ElfW(Phdr)& segment = info->dlpi_phdr[i];
    if (segment.p_type != PT_NOTE) continue;
    const auto* notes = reinterpret_cast<const char*>(info->dlpi_addr + segment.p_vaddr);
    auto& id = *static_cast<std::string*>(out);
    if (id = id_among(notes, segment.p_memsz); !id.empty()) break;
  }
  return 1;
}

std::string find_build() {
  std::string id;
  dl_iterate_phdr(take_id, &id);
  return kCompiler + (id.empty() ? "" : ", " + id);
}

}  // namespace

const std::string& this_build() {
  static const std::string build = find_build();
  return build;
}

}  // namespace mbcosim::server
