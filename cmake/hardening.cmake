# Hardening (on by default), sanitizers and fuzzers (off by default).
option(WITH_HARDENING "Stack protector, checked string functions, read-only relocations, PIE" ON)
option(WITH_FUZZERS "Build test/fuzz as fuzzers, with ASan and UBSan (needs clang)" OFF)
set(WITH_SANITIZER "" CACHE STRING
    "address (with undefined; clang: also float divisions) or thread; see scripts/check_sanitizers")
set_property(CACHE WITH_SANITIZER PROPERTY STRINGS "" address thread)
if(NOT WITH_SANITIZER MATCHES "^(address|thread)?$")
  message(FATAL_ERROR "WITH_SANITIZER=${WITH_SANITIZER}, but it must be address, thread or empty")
endif()
if(WITH_FUZZERS AND NOT CMAKE_CXX_COMPILER_ID MATCHES "Clang")
  message(FATAL_ERROR "WITH_FUZZERS=ON needs clang: set CMAKE_CXX_COMPILER=clang++ in a new build "
                      "folder, or use scripts/fuzz")
endif()

if(WITH_FUZZERS)
  set(WITH_SANITIZER address)
  add_compile_options(-fsanitize=fuzzer-no-link)
endif()
if(WITH_SANITIZER STREQUAL "address")
  # Float divisions by 0 do not abort, so that a suppression list can allow intended ones. Only
  # clang checks float divisions and casts.
  set(flags -fsanitize=address,undefined -fno-sanitize-recover=undefined)
  if(CMAKE_CXX_COMPILER_ID MATCHES "Clang")
    list(APPEND flags -fsanitize=float-divide-by-zero,float-cast-overflow
                      -fno-sanitize-recover=float-cast-overflow)
  endif()
elseif(WITH_SANITIZER STREQUAL "thread")
  set(flags -fsanitize=thread)
endif()
if(WITH_SANITIZER)
  add_compile_options(${flags} -fno-omit-frame-pointer -g1)
  add_link_options(${flags})
endif()

# _FORTIFY_SOURCE needs optimisation, and would hide faults from the sanitizers, so debug builds and
# builds with a sanitizer do not use it.
if(WITH_HARDENING)
  include(CheckPIESupported)
  check_pie_supported(LANGUAGES CXX)
  add_compile_options($<$<COMPILE_LANGUAGE:CXX>:-fstack-protector-strong>)
  add_link_options(-Wl,-z,relro,-z,now)
  if(NOT WITH_SANITIZER)
    set(fortified $<AND:$<COMPILE_LANGUAGE:CXX>,$<NOT:$<CONFIG:Debug>>>)
    add_compile_options($<${fortified}:-U_FORTIFY_SOURCE> $<${fortified}:-D_FORTIFY_SOURCE=2>)
  endif()
endif()
