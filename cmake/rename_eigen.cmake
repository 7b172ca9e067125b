# Eigen's functions in a static library get names of their own. A program that links to it has functions of
# the same names, perhaps compiled for other instructions, whose memory has another alignment; the linker
# would take one of the two for both.
#   cmake -DARCHIVE=libgradpsi.a -DNM=nm -DOBJCOPY=objcopy -P rename_eigen.cmake
execute_process(COMMAND ${NM} --defined-only --format=posix ${ARCHIVE}
  OUTPUT_VARIABLE symbols COMMAND_ERROR_IS_FATAL ANY)
# Weak functions (W), weak objects (V), unique ones (u) and what constructors are grouped by (n), with Eigen
# in their names or their arguments'.
string(REGEX MATCHALL "\n_Z[^ \n]*5Eigen[^ \n]* [WVun] " symbols "${symbols}")
list(REMOVE_DUPLICATES symbols)
set(names "")
foreach(symbol IN LISTS symbols)
  string(REGEX REPLACE "\n| .*" "" name "${symbol}")
  string(APPEND names "${name} gradpsi${name}\n")
endforeach()
file(WRITE ${ARCHIVE}.names "${names}")
execute_process(COMMAND ${OBJCOPY} --redefine-syms=${ARCHIVE}.names ${ARCHIVE} COMMAND_ERROR_IS_FATAL ANY)
