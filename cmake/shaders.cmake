# Embeds the shaders, and the header that C and GLSL share, into the binary: generates
# shader_text.c, an array of names and texts (render/gl/shader_text.h). Included by
# render/CMakeLists.txt; runs itself as a script at build time when a shader has changed.
if(CMAKE_SCRIPT_MODE_FILE)
    set(code "#include \"gl/shader_text.h\"\n\n")
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
    string(APPEND code "const trip_gl_shader_text trip_gl_shader_texts[] = {\n${table}    { 0, 0 },\n};\n")
    file(WRITE ${TRIP_SHADER_OUTPUT} "${code}")
    return()
endif()

# trip_embed_shaders(TARGET): adds the generated source to the target.
function(trip_embed_shaders target)
    file(GLOB files CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/shaders/*.vert
         ${CMAKE_SOURCE_DIR}/shaders/*.frag ${CMAKE_SOURCE_DIR}/shaders/*.comp
         ${CMAKE_SOURCE_DIR}/shaders/*.glsl)
    list(APPEND files ${CMAKE_SOURCE_DIR}/render/gl/shared.h)
    set(output ${CMAKE_CURRENT_BINARY_DIR}/shader_text.c)
    add_custom_command(
        OUTPUT ${output}
        COMMAND ${CMAKE_COMMAND} "-DTRIP_SHADER_FILES=${files}" -DTRIP_SHADER_OUTPUT=${output}
                -P ${CMAKE_SOURCE_DIR}/cmake/shaders.cmake
        DEPENDS ${files} ${CMAKE_SOURCE_DIR}/cmake/shaders.cmake
        COMMENT "Embedding shaders"
        VERBATIM)
    target_sources(${target} PRIVATE ${output})
endfunction()
