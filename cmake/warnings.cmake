# Warning flags for our own targets: trip_warnings(TARGET). Shims in C++ get the common subset.
add_library(trip_flags INTERFACE)
target_compile_definitions(trip_flags INTERFACE _GNU_SOURCE _FILE_OFFSET_BITS=64)
target_compile_options(trip_flags INTERFACE
    -Wall -Wextra -Wshadow -Wundef -Wformat=2 -Wpointer-arith
    $<$<COMPILE_LANGUAGE:C>:-Wstrict-prototypes>
    $<$<COMPILE_LANGUAGE:C>:-Wmissing-prototypes>
    $<$<COMPILE_LANGUAGE:C>:-Wcast-qual>
    $<$<COMPILE_LANGUAGE:C>:-Wvla>
    # The image is a function of data and settings only: no contraction that depends on the compiler's mood.
    -ffp-contract=off
    $<$<BOOL:${TRIP_WERROR}>:-Werror>)
if(TRIP_SANITIZE)
    # Whatever is found ends the program, which fails the test.
    target_compile_options(trip_flags INTERFACE -fsanitize=${TRIP_SANITIZE} -fno-sanitize-recover=all
                           -fno-omit-frame-pointer)
    target_link_options(trip_flags INTERFACE -fsanitize=${TRIP_SANITIZE})
endif()
# trip_sanitize_lightly(SOURCES...): what instantiates OpenVDB's trees whole takes the compiler ten
# minutes under UndefinedBehaviorSanitizer with optimisation; AddressSanitizer stays.
function(trip_sanitize_lightly)
    if(TRIP_SANITIZE)
        set_source_files_properties(${ARGN} PROPERTIES COMPILE_OPTIONS "-O1;-fno-sanitize=undefined")
    endif()
endfunction()
# What the fuzzers follow: the parsers of outside bytes. Elsewhere it would only slow the tests.
if(TRIP_FUZZ)
    set(parsers trip_common trip_images trip_stream trip_preprocess trip_view_model)
    target_compile_options(trip_flags INTERFACE
        "$<$<IN_LIST:$<TARGET_PROPERTY:NAME>,${parsers}>:-fsanitize=fuzzer-no-link>")
endif()
