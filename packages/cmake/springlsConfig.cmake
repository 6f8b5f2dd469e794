# What `make install` gives find_package(springls): the target springls::springls, which is the folder of the headers and libm.
if(NOT TARGET springls::springls)
    get_filename_component(springls_include "${CMAKE_CURRENT_LIST_DIR}/../../../include" ABSOLUTE)
    add_library(springls::springls INTERFACE IMPORTED)
    set_target_properties(springls::springls PROPERTIES
        INTERFACE_INCLUDE_DIRECTORIES "${springls_include}" INTERFACE_LINK_LIBRARIES "$<$<NOT:$<PLATFORM_ID:Windows>>:m>")
endif()
