# Tab completion of isethdr in bash. Put into ~/.bashrc:
#   eval "$(isethdr completion bash)"
_isethdr() {
    local line="${COMP_LINE:0:COMP_POINT}" found
    local -a typed
    read -ra typed <<<"$line"
    [[ "$line" == *[[:space:]] ]] && typed+=("")
    local current="${typed[${#typed[@]}-1]}"
    COMPREPLY=()
    while IFS= read -r found; do
        [[ -n "$found" ]] && COMPREPLY+=("$found")
    done < <(isethdr complete -- "${typed[@]:1}" 2>/dev/null)
    # readline replaces what follows the last separator, not the whole word
    local last="${current##*[=:@]}"
    local before="${current%"$last"}"
    COMPREPLY=("${COMPREPLY[@]#"$before"}")
    if [[ ${#COMPREPLY[@]} == 1 && "${COMPREPLY[0]}" == *[=.] ]]; then
        compopt -o nospace 2>/dev/null
    fi
    return 0
}
complete -F _isethdr isethdr
