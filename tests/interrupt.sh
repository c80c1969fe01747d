# To be sourced. interrupt PID: Ctrl-C, once the program handles it; a background process of a script ignores it before.
interrupt() {
  local caught i
  for ((i = 0; i < 1200; ++i)); do
    caught=$(sed -n 's/^SigCgt:[[:space:]]*//p' "/proc/$1/status" 2> /dev/null)
    ((0x${caught:-0} & 2)) && break
    sleep 0.05
  done
  kill -INT "$1"
}
