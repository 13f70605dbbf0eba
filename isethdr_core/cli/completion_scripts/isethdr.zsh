#compdef isethdr
# Tab completion of isethdr in zsh. Put into ~/.zshrc, behind compinit:
#   eval "$(isethdr completion zsh)"
_isethdr() {
    local -a found whole open
    found=("${(@f)$(isethdr complete -- "${(@)words[2,CURRENT]}" 2>/dev/null)}")
    whole=(${found:#*[=.]})
    open=(${(M)found:#*[=.]})
    (( ${#whole} )) && compadd -a whole
    (( ${#open} )) && compadd -S '' -a open
    return 0
}
compdef _isethdr isethdr
