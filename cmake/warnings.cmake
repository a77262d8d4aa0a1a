# Compiler flags for Triptych's own targets (trip_flags). C++ gets the flags that C and C++ share.
add_library(trip_flags INTERFACE)
target_compile_definitions(trip_flags INTERFACE _GNU_SOURCE _FILE_OFFSET_BITS=64)
target_compile_options(trip_flags INTERFACE
    -Wall -Wextra -Wshadow -Wundef -Wformat=2 -Wpointer-arith
    $<$<COMPILE_LANGUAGE:C>:-Wstrict-prototypes>
    $<$<COMPILE_LANGUAGE:C>:-Wmissing-prototypes>
    $<$<COMPILE_LANGUAGE:C>:-Wcast-qual>
    $<$<COMPILE_LANGUAGE:C>:-Wvla>
    # Contraction would let the image depend on the compiler and not only on data and settings.
    -ffp-contract=off
    $<$<BOOL:${TRIP_WERROR}>:-Werror>)
if(TRIP_SANITIZE)
    # A finding ends the program, so that the test fails.
    target_compile_options(trip_flags INTERFACE -fsanitize=${TRIP_SANITIZE} -fno-sanitize-recover=all
                           -fno-omit-frame-pointer)
    target_link_options(trip_flags INTERFACE -fsanitize=${TRIP_SANITIZE})
endif()
# trip_sanitize_lightly(SOURCES...): compiles without UndefinedBehaviorSanitizer and with less
# optimisation. Sources that instantiate whole OpenVDB trees would otherwise take the compiler ten
# minutes. AddressSanitizer stays on.
function(trip_sanitize_lightly)
    if(TRIP_SANITIZE)
        set_source_files_properties(${ARGN} PROPERTIES COMPILE_OPTIONS "-O1;-fno-sanitize=undefined")
    endif()
endfunction()
# Instruments the parsers of outside bytes, which the fuzzers explore. Instrumenting other code
# would only slow the tests.
if(TRIP_FUZZ)
    set(parsers trip_common trip_stream trip_preprocess trip_view_model)
    target_compile_options(trip_flags INTERFACE
        "$<$<IN_LIST:$<TARGET_PROPERTY:NAME>,${parsers}>:-fsanitize=fuzzer-no-link>")
endif()
