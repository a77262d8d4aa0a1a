# shellcheck shell=sh
# Functions that print progress. Other scripts read this file.

progress_label=
progress_tenth=0

# progress LABEL PERCENT NOTE: replaces the last line on a terminal. Elsewhere prints a line after each
# tenth of the whole.
progress() {
    if [ -t 1 ]; then
        printf '\r%.79s\033[K' "$1: $2 %  $3"
        return
    fi
    if [ "$1" != "$progress_label" ]; then
        progress_tenth=0
    fi
    if [ $(($2 / 10)) -gt "$progress_tenth" ]; then
        echo "$1: $2 %  $3"
    fi
    progress_label=$1
    progress_tenth=$(($2 / 10))
}

# Removes the line of progress() from a terminal.
progress_end() {
    progress_label=
    if [ -t 1 ]; then
        printf '\r\033[K'
    fi
}

# follow_ninja LOG COMMAND...: runs a build with Ninja and prints its progress. The log gets all output.
# Ninja prints lines such as: [12/380] Building C object stream/...
follow_ninja() {
    log=$1
    shift
    { NINJA_STATUS='[%f/%t] ' "$@" 2>&1 || echo "follow_ninja: failed"; } | {
        failed=0
        while IFS= read -r line; do
            echo "$line" >&3
            case $line in
            "["*/*"] "*)
                done=${line#"["} total=${line#*/}
                done=${done%%/*} total=${total%%"]"*}
                progress Building $((100 * done / total)) "$done of $total"
                ;;
            "follow_ninja: failed") failed=1 ;;
            esac
        done 3>>"$log"
        progress_end
        [ $failed = 0 ]
    }
}

# duration SECONDS: prints a duration such as `3 min 20 s`.
duration() {
    if [ "$1" -ge 60 ]; then
        echo "$(($1 / 60)) min $(($1 % 60)) s"
    else
        echo "$1 s"
    fi
}

# free_megabytes FOLDER: prints the room on the folder's disk.
free_megabytes() {
    df -Pm "$1" | awk 'NR == 2 { print $4 }'
}
