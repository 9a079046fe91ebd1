# How every target of the project is compiled, and the one way to declare a module or a test.

find_package(Threads REQUIRED)

# The same bits on every target: no fused multiply-add, never -ffast-math. The other two keep the bits and let loops
# vectorise.
add_library(spinaltap_flags INTERFACE)
target_compile_options(spinaltap_flags INTERFACE -ffp-contract=off -fno-math-errno -fno-trapping-math
  -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor)
# Under the sanitizers g++ 12 warns of what their own instrumentation does (a replaced operator delete "mismatched").
if(NOT CMAKE_CXX_FLAGS MATCHES "-fsanitize")
  target_compile_options(spinaltap_flags INTERFACE -Werror)
endif()
target_include_directories(spinaltap_flags INTERFACE ${CMAKE_SOURCE_DIR})
if(EMSCRIPTEN)
  # Debian's header-only libraries, through a folder of links: -I/usr/include would shadow the sysroot.
  set(links ${CMAKE_BINARY_DIR}/header_only)
  file(MAKE_DIRECTORY ${links})
  foreach(library tl eigen3 hwy)
    file(CREATE_LINK /usr/include/${library} ${links}/${library} SYMBOLIC)
  endforeach()
  target_include_directories(spinaltap_flags SYSTEM INTERFACE ${links} ${links}/eigen3)
  target_compile_options(spinaltap_flags INTERFACE -msimd128)
  # Debian's emscripten looks for its own node modules there when it links.
  set_property(GLOBAL PROPERTY RULE_LAUNCH_LINK "${CMAKE_COMMAND} -E env NODE_PATH=/usr/share/nodejs")
else()
  target_include_directories(spinaltap_flags SYSTEM INTERFACE /usr/include/eigen3)
  target_link_libraries(spinaltap_flags INTERFACE Threads::Threads)
endif()

# Highway: every inner loop once for each of a few vector widths, chosen at run time; in the browser the one it has.
# Its 1.0's WebAssembly vectors have no doubles; its portable ones do, and the compiler makes simd128 of them. Modules
# whose vectors are all of singles take the former.
add_library(spinaltap_simd_singles INTERFACE)
add_library(spinaltap_simd INTERFACE)
target_link_libraries(spinaltap_simd INTERFACE spinaltap_simd_singles)
if(EMSCRIPTEN)
  target_compile_definitions(spinaltap_simd INTERFACE HWY_COMPILE_ONLY_EMU128)
else()
  target_compile_definitions(spinaltap_simd_singles INTERFACE "HWY_DISABLED_TARGETS=(HWY_SSSE3|HWY_AVX3_DL)")
  find_library(HIGHWAY hwy REQUIRED)
  target_link_libraries(spinaltap_simd_singles INTERFACE ${HIGHWAY})
endif()

# spinaltap_module(core rbf DEPS base): a static library spinaltap_core_rbf of every .cpp in its own folder.
function(spinaltap_module room name)
  cmake_parse_arguments(ARG "" "" "DEPS;LIBRARIES" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*.cpp)
  set(target spinaltap_${room}_${name})
  if(sources)
    add_library(${target} STATIC ${sources})
    set(scope PUBLIC)
  else()
    add_library(${target} INTERFACE)
    set(scope INTERFACE)
  endif()
  target_link_libraries(${target} ${scope} spinaltap_flags ${ARG_LIBRARIES})
  foreach(dep ${ARG_DEPS})
    target_link_libraries(${target} ${scope} spinaltap_${dep})
  endforeach()
endfunction()

# spinaltap_test(core_rbf DEPS core_rbf core_phantom): one program and one ctest entry of every *_test.cpp in its folder.
function(spinaltap_test name)
  cmake_parse_arguments(ARG "" "" "DEPS;LIBRARIES;LABELS" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/*_test.cpp)
  set(target test_${name})
  add_executable(${target} ${sources})
  target_link_libraries(${target} PRIVATE spinaltap_flags spinaltap_gtest ${ARG_LIBRARIES})
  foreach(dep ${ARG_DEPS})
    target_link_libraries(${target} PRIVATE spinaltap_${dep})
  endforeach()
  if(name MATCHES "^(core_|server_import)")
    add_dependencies(core_and_import_tests ${target})  # what the sanitizer preset builds
  endif()
  if(EMSCRIPTEN)
    # Without the flag, node 18 and later would fetch() the .wasm file, which emscripten of old cannot do from a path.
    set_target_properties(${target} PROPERTIES CROSSCOMPILING_EMULATOR "${NODE_JS_EXECUTABLE};--no-experimental-fetch")
    target_link_options(${target} PRIVATE -sENVIRONMENT=node -sEXIT_RUNTIME=1 -sALLOW_MEMORY_GROWTH=1)
  endif()
  add_test(NAME ${name} COMMAND ${target})
  set_tests_properties(${name} PROPERTIES TIMEOUT 900 LABELS "${ARG_LABELS}")
endfunction()
