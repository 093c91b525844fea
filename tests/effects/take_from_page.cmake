# SPDX-License-Identifier: MIT
# Takes the example out of docs/adding-an-effect.md: its C++ becomes EFFECT_OUT, its added line goes into a copy of the
# registry, REGISTRY_OUT. Anything that is not as the page says is an error.
file(READ ${PAGE} page)
if(NOT page MATCHES "\n```cpp\n(.*)\n```\n\n## 2")
  message(FATAL_ERROR "${PAGE}: no C++ block in section 1")
endif()
file(WRITE ${EFFECT_OUT} "${CMAKE_MATCH_1}\n")

if(NOT page MATCHES "\n```diff\n (  EFFECT[^\n]*\n)\\+(  EFFECT[^\n]*\n) (  EFFECT[^\n]*\n)```")
  message(FATAL_ERROR "${PAGE}: no diff block of three lines")
endif()
set(before "${CMAKE_MATCH_1}")
set(added "${CMAKE_MATCH_2}")
set(after "${CMAKE_MATCH_3}")
file(READ ${REGISTRY} registry)
string(FIND "${registry}" "${before}${after}" at)
if(at EQUAL -1)
  message(FATAL_ERROR "${PAGE}: ${REGISTRY} has no such lines one after the other:\n${before}${after}")
endif()
string(REPLACE "${before}${after}" "${before}${added}${after}" registry "${registry}")
file(WRITE ${REGISTRY_OUT} "${registry}")
