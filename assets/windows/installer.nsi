; Installer for one user, without rights of an administrator:
;   makensis -DVERSION=0.1.0 -DFOLDER=<files to install> -DREMOVE=<remove.nsh> -DSETUP=<setup.exe> installer.nsi
; REMOVE deletes those files one by one: there may be others in the folder that a person chose.
; `setup.exe /S` installs and `uninstall.exe /S` removes without questions.
Unicode true
Target amd64-unicode
!include MUI2.nsh
!include FileFunc.nsh

!define KEY Software\Microsoft\Windows\CurrentVersion\Uninstall\lightgrid

Name lightgrid
OutFile "${SETUP}"
InstallDir "$LOCALAPPDATA\Programs\lightgrid"
InstallDirRegKey HKCU "${KEY}" InstallLocation
RequestExecutionLevel user
SetCompressor /SOLID lzma
VIProductVersion ${VERSION}.0
VIAddVersionKey ProductName lightgrid
VIAddVersionKey FileDescription "lightgrid ${VERSION}, setup"
VIAddVersionKey FileVersion ${VERSION}
VIAddVersionKey LegalCopyright "The lightgrid authors, MIT OR Apache-2.0"

!define MUI_ICON "${FOLDER}\lightgrid.ico"
!define MUI_UNICON "${FOLDER}\lightgrid.ico"
!insertmacro MUI_PAGE_DIRECTORY
!insertmacro MUI_PAGE_INSTFILES
!define MUI_FINISHPAGE_RUN "$INSTDIR\lightgrid.exe"
!insertmacro MUI_PAGE_FINISH
!insertmacro MUI_UNPAGE_CONFIRM
!insertmacro MUI_UNPAGE_INSTFILES
!insertmacro MUI_LANGUAGE English

; "Open with" for a file type: whoever opens it today still does.
!macro OPEN_WITH TYPE
    WriteRegStr HKCU "Software\Classes\${TYPE}\OpenWithProgids" lightgrid.scene ""
    WriteRegStr HKCU "Software\Classes\Applications\lightgrid.exe\SupportedTypes" ${TYPE} ""
!macroend
!macro FORGET_OPEN_WITH TYPE
    DeleteRegValue HKCU "Software\Classes\${TYPE}\OpenWithProgids" lightgrid.scene
!macroend

Section
    SetOutPath $INSTDIR
    File /r "${FOLDER}\*"
    CreateShortcut "$SMPROGRAMS\lightgrid.lnk" "$INSTDIR\lightgrid.exe"
    WriteRegStr HKCU Software\Classes\lightgrid.scene "" "Scene or environment map"
    WriteRegStr HKCU Software\Classes\lightgrid.scene\DefaultIcon "" "$INSTDIR\lightgrid.exe,0"
    WriteRegStr HKCU Software\Classes\lightgrid.scene\shell\open\command "" '"$INSTDIR\lightgrid.exe" view "%1"'
    WriteRegStr HKCU Software\Classes\Applications\lightgrid.exe\shell\open\command "" '"$INSTDIR\lightgrid.exe" view "%1"'
    !insertmacro OPEN_WITH .gltf
    !insertmacro OPEN_WITH .glb
    !insertmacro OPEN_WITH .hdr
    !insertmacro OPEN_WITH .exr
    WriteUninstaller "$INSTDIR\uninstall.exe"
    WriteRegStr HKCU "${KEY}" DisplayName lightgrid
    WriteRegStr HKCU "${KEY}" DisplayVersion ${VERSION}
    WriteRegStr HKCU "${KEY}" DisplayIcon "$INSTDIR\lightgrid.exe,0"
    WriteRegStr HKCU "${KEY}" Publisher "The lightgrid authors"
    WriteRegStr HKCU "${KEY}" InstallLocation $INSTDIR
    WriteRegStr HKCU "${KEY}" UninstallString '"$INSTDIR\uninstall.exe"'
    WriteRegStr HKCU "${KEY}" QuietUninstallString '"$INSTDIR\uninstall.exe" /S'
    WriteRegDWORD HKCU "${KEY}" NoModify 1
    WriteRegDWORD HKCU "${KEY}" NoRepair 1
    ${GetSize} "$INSTDIR" "/S=0K" $0 $1 $2
    WriteRegDWORD HKCU "${KEY}" EstimatedSize $0
    ; Explorer reads file types again.
    System::Call 'shell32::SHChangeNotify(i 0x08000000, i 0, p 0, p 0)'
SectionEnd

; Settings and kept pictures stay.
Section Uninstall
    !include "${REMOVE}"
    Delete "$INSTDIR\uninstall.exe"
    RMDir "$INSTDIR"
    Delete "$SMPROGRAMS\lightgrid.lnk"
    !insertmacro FORGET_OPEN_WITH .gltf
    !insertmacro FORGET_OPEN_WITH .glb
    !insertmacro FORGET_OPEN_WITH .hdr
    !insertmacro FORGET_OPEN_WITH .exr
    DeleteRegKey HKCU Software\Classes\lightgrid.scene
    DeleteRegKey HKCU Software\Classes\Applications\lightgrid.exe
    DeleteRegKey HKCU "${KEY}"
    System::Call 'shell32::SHChangeNotify(i 0x08000000, i 0, p 0, p 0)'
SectionEnd
