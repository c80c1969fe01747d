# To be sourced. interrupt PID: Ctrl-C, once the program handles it; a background process of a script ignores it before, and is
# a copy of the shell, with the shell's handlers, until the program replaces it.
interrupt() {
  local caught i shell
  shell=$(readlink "/proc/$$/exe")
  for ((i = 0; i < 1200; ++i)); do
    caught=$(sed -n 's/^SigCgt:[[:space:]]*//p' "/proc/$1/status" 2> /dev/null)
    ((0x${caught:-0} & 2)) && [[ $(readlink "/proc/$1/exe") != "$shell" ]] && break
    sleep 0.05
  done
  kill -INT "$1"
}
