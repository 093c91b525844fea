// SPDX-License-Identifier: MIT
// Audit library of the dynamic linker (rtld-audit(7)): leaves a file where its code runs.
#include <cstdio>

extern "C" unsigned int la_version(unsigned int version);
extern "C" unsigned int la_version(unsigned int version) {
  std::FILE* mark = std::fopen(AUDIT_MARK, "w");
  if (mark != nullptr) std::fclose(mark);
  return version;
}
