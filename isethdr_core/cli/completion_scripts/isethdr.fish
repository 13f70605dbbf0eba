# Tab completion of isethdr in fish. Put into ~/.config/fish/completions/isethdr.fish:
#   isethdr completion fish > ~/.config/fish/completions/isethdr.fish
complete -c isethdr -e
complete -c isethdr -f -a '(isethdr complete -- (commandline -opc)[2..-1] (commandline -ct) 2>/dev/null)'
