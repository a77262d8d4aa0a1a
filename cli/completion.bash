# Completes commands, options and files of triptych in bash. The program itself lists its options.
_triptych()
{
    local word=${COMP_WORDS[COMP_CWORD]} command=${COMP_WORDS[1]}
    COMPREPLY=()
    if ((COMP_CWORD == 1)); then
        local commands
        commands=$("$1" --help | sed -n 's/^  \([a-z]*\) .*/\1/p')
        mapfile -t COMPREPLY < <(compgen -W "$commands --help --version" -- "$word")
    elif [[ $word == --* ]]; then
        local names
        names=$("$1" "$command" --help=names 2>/dev/null | cut -d ' ' -f 1)
        mapfile -t COMPREPLY < <(compgen -W "$names --help" -- "$word")
    else
        local before=${COMP_WORDS[COMP_CWORD - 1]} argument
        argument=$("$1" "$command" --help=names 2>/dev/null | sed -n "s/^$before //p")
        if [[ $argument == *[a-z]\|* ]]; then
            mapfile -t COMPREPLY < <(compgen -W "${argument//|/ }" -- "$word")
        fi
        ((${#COMPREPLY[@]})) || compopt -o default
    fi
}
complete -F _triptych triptych
