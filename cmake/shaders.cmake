# Embeds shaders, and headers shared by C and GLSL, into the binary. Generates shader_text.c, an
# array of names and texts that HEADER declares. A CMakeLists.txt includes this file. At build time,
# this file runs as a script when a shader has changed.
if(CMAKE_SCRIPT_MODE_FILE)
    set(code "#include \"${TRIP_SHADER_HEADER}\"\n\n")
    set(table "")
    foreach(file IN LISTS TRIP_SHADER_FILES)
        get_filename_component(name ${file} NAME)
        string(MAKE_C_IDENTIFIER ${name} symbol)
        file(READ ${file} text HEX)
        string(REGEX REPLACE "([0-9a-f][0-9a-f])" "0x\\1," text "${text}")
        string(REPLACE "0x0a," "0x0a,\n    " text "${text}")
        string(APPEND code "static const char text_${symbol}[] = {\n    ${text}0,\n};\n\n")
        string(APPEND table "    { \"${name}\", text_${symbol} },\n")
    endforeach()
    string(APPEND code "const ${TRIP_SHADER_PREFIX}_shader_text ${TRIP_SHADER_PREFIX}_shader_texts[] = {\n${table}    { 0, 0 },\n};\n")
    file(WRITE ${TRIP_SHADER_OUTPUT} "${code}")
    return()
endif()

# trip_embed_shaders(TARGET PREFIX HEADER FILES...): adds the generated source to the target. HEADER
# declares the array PREFIX_shader_texts.
function(trip_embed_shaders target prefix header)
    set(files ${ARGN})
    set(output ${CMAKE_CURRENT_BINARY_DIR}/shader_text.c)
    add_custom_command(
        OUTPUT ${output}
        COMMAND ${CMAKE_COMMAND} "-DTRIP_SHADER_FILES=${files}" -DTRIP_SHADER_OUTPUT=${output}
                -DTRIP_SHADER_PREFIX=${prefix} -DTRIP_SHADER_HEADER=${header}
                -P ${CMAKE_SOURCE_DIR}/cmake/shaders.cmake
        DEPENDS ${files} ${CMAKE_SOURCE_DIR}/cmake/shaders.cmake
        COMMENT "Embedding shaders"
        VERBATIM)
    target_sources(${target} PRIVATE ${output})
endfunction()
